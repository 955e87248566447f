"""What benches write, turned into experiments: a module for each step.

`decode` makes text of bytes, `delimited` and `workbook` make cells of text and of xlsx, `table` finds the header and
the readings among them, `numerals` and `clock` say what a cell means, `quantities` and `columns` what a column is,
`holds`, `plateaus` and `thinning` cut the readings into holds, `resolution` sees how tensions were rounded, and
`convert` joins these. Where two readings are possible, none is chosen: `undecided` asks.
"""
