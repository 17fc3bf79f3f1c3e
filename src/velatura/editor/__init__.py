"""The editor in the browser: its page, what the page asks of the model, and the server that brings both together.

`service` has what any page needs, `folder` what a server adds, files; neither knows HTTP, which `server` alone speaks.
"""
