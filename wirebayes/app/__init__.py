"""The same in a browser on this machine: `server` serves pages on the loopback address, `page` says what they show.

`folders` keeps what was dropped and what came of it; `jobs` does the work in processes of their own, whose one function
is in `work`. Whatever computes or draws is loaded there: the server stays small, and a file leaves nothing in it.
"""
