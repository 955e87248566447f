"""What the JSON files hold: a module for each, the keys of one level a `TypedDict`.

An array here is a list in the file, NaN and infinity are null there. Keys carry their unit.
"""
