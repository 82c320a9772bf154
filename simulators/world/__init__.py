"""The emulated world of a driven arm: MuJoCo, servo, laser, fixture and detectors, advanced by emulated time.

Open `world.World` first. Instruments read it through a few methods; mechanisms of simulators/defects take hold in
`moving_mechanisms`. What a rig file may state of the world stands in `rig`, what is drawn from its seed in `truth`.
"""
