"""What needs both the tables and the clips: tables made from clips, motion coverage, weights written from the debugger.

The rooms of the tables and `contextdb.motion` know nothing of each other; what joins them is here and in the commands.
"""
