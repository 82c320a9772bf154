"""What a reading should be: parameters, rigid motions, arms, sensors, effects, and the chain that they form.

Forward only: nothing here is fitted. Modules of this folder are doors themselves; `arms`, `sensors` and `effects` are
the catalogues, one file an entry.
"""
