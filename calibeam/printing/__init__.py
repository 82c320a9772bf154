"""What the commands print in a terminal: tables and lines, one module a subject.

Every function takes a console and a record that has been worked out, and computes nothing itself. Words and units come
from calibrate/report, so that terminal and pages agree.
"""
