# SPDX-License-Identifier: MIT
"""Every file of the set: its name and the function that gives its content, as text or bytes."""
FILES = {}


def file(name):
    def keep(function):
        if name in FILES:
            raise ValueError(f"two files are called {name}")
        FILES[name] = function
        return function
    return keep
