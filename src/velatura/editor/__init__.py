"""The editor in the browser: its page, the calls of the page to the model, and the server of both.

`service` has the calls of every page, `folder` those for the files of a server; only `server` knows HTTP.
"""
