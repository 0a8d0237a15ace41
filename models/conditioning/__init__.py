"""A film made fit before anything is judged: camera steadied, flag found, cropped to it, all else frozen.

`conditioned` does it to a short film in memory; `conditioning_of` and `Follower` are its two parts for a film that is
read as a stream.
"""

from models.conditioning.conditioning import Conditioned, Conditioning, Follower, conditioned, conditioning_of

__all__ = ["Conditioned", "Conditioning", "Follower", "conditioned", "conditioning_of"]
