"""Files written by test benches, turned into experiments: a module for each step.

`decode` turns bytes into text, `delimited` and `workbook` turn text and xlsx into cells, `table` finds the header and
the readings among them, `numerals` and `clock` interpret a cell, `quantities` and `columns` a column, `stamps`
times of a coarse clock, `unread` the columns that are left over, `holds`, `plateaus` and `thinning` divide the readings
into holds, `resolution` finds how tensions were rounded, and `convert` joins these. Where two interpretations are
possible, none is chosen: `undecided` asks.
"""
