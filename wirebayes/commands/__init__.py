"""What users run, each in a module: joins inference, results, discovery, robots and pages.

`wirebayes` offers these functions by name; the command line parses arguments, calls them and prints.
"""
