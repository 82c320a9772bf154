"""A session on site, step by step: `calibeam session`.

Open first `run.OnSite`: the order of the steps; what each does is in `with_detectors` and `with_tracker`. `job` holds
what is asked for and what earlier parts have taken, `measure` runs the plan, `person` and `keys` are whoever decides,
`forecast` predicts what more poses bring, `reporter` keeps the `status` and informs the `views`. A new view is a class
with the methods of `status.Listener`.
"""
