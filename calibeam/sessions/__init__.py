"""A session on site, step by step: `calibeam session`.

Open first `run.run_session`. `job` holds what is asked for and what earlier parts have taken, `measure` runs the plan,
`person` and `keys` are whoever decides, `forecast` predicts what more poses bring, `reporter` keeps the `status` and
informs the `views`. A new view is a class with the methods of `status.Listener`.
"""
