"""The explorer, `gonio view`: a page in the browser, a server on this machine, and a process that knows materials.

`server.py` answers the page and looks after who asks; it reads no material. `worker.py` runs in a process of its own,
which may crash or be ended; `session.py` starts it and hands messages on (`messages.py`). `calls.py` is what a page may
ask for, `describe.py` a material as a page needs it, `export.py` the page as one file.
"""
