"""The compiled core; private. Its public face are the modules of this package."""

__all__ = ["__version__"]

__version__: str
