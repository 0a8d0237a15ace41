"""The page of a lake, `flagdata view`: read-only, on this machine alone, with no part from anywhere else.

films (what moves, as pictures) → media (thumbnails, frames, winds as answers) → pages (HTML) → routes (addresses to
answers, without a socket) → server (the socket and who may ask).
"""
