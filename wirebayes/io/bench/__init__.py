"""Files written by test benches, turned into experiments: a module for each step.

`decode` turns bytes into text, `delimited`, `labview` and `workbook` turn text and xlsx into cells, `table` finds the
header and the readings among them, `numerals` and `clock` interpret a cell, `quantities` and `columns` a column,
`stamps` times of a coarse clock, `two_clocks` those of two columns, `unread` the columns that are left over. `control`
finds what was set, `resets` joins pieces of a recording, `holds`, `flicker`, `continuous`, `plateaus` and `thinning`
divide the readings into holds, `resolution` finds how they were rounded, and `convert` joins these. Where two
interpretations are possible, none is chosen: `undecided` asks.
"""
