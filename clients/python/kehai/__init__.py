"""People counted and tracked by kehai-tracker.

from kehai import Tracker
for people in Tracker("http://127.0.0.1:8420").people():
    print(people)  # {'hall': 2, 'kitchen': None}: None is not known, which is never empty
"""

from kehai.tracker import Refused, Tracker

__all__ = ["Refused", "Tracker"]
