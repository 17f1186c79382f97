"""Do the regions of registered poses hold the truth? A thousand small simulated yards.

``python -m benches.accuracy.registration run``. Yards are seen through packets and the public
``Test.calibrate``: ray casting takes the time, packets hardly any, and so the whole way is judged.
"""
