"""The concealed proof: `calibeam prove` hides physics in simulated sessions, has them diagnosed blindly, and scores.

Open first `prove.prove`: `scenario` draws cases, `concealing` writes recordings and seals, `diagnosing` has `blind`
processes answer, `scoring` compares with the opened seal, `tally` and `page` sum up. A new kind of case is a line in
`scenario`.
"""
