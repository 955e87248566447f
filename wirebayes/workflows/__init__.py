"""What people ask for, each in a module: joins inference, results, discovery, robots and pages.

`wirebayes` offers these functions by name; the command line parses words, calls them and prints.
"""
