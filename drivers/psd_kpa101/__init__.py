"""Thorlabs KPA101, one for each detector, by its APT messages: `codec` and `messages`, one box (`unit`), two as one
device (`pair`), and what can be asked of them before a session (`selfcheck`).
"""
