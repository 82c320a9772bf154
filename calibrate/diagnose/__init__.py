"""Which physics the geometric model leaves out, how sure that is, and what cannot be decided.

`state` is a session fitted with effects, `search` changes which effects there are, `doubts` weighs the result,
`streams` judges clocks and channels, `record` is diagnosis.json.
"""
