"""A worker that speaks the protocol but renders nothing; misbehaves as its arguments say.

    fake_worker.py COUNTER MODE AT

COUNTER is a file with the number of requests ever answered; at request AT (once, or always where AT
ends in "+") the worker crashes, hangs, or speaks nonsense, by MODE.
"""

import os
import sys
import time
from pathlib import Path

from sim.blender import Message, decode, encode


def main() -> None:
    counter, mode, at = Path(sys.argv[1]), sys.argv[2], sys.argv[3]

    def send(message: Message) -> None:
        os.write(1, encode(message))

    def read(count: int) -> bytes:
        data = sys.stdin.buffer.read(count)
        if len(data) < count:
            raise EOFError
        return data

    send(Message(kind="ready"))
    while True:
        try:
            message = decode(read)
        except EOFError:
            return
        if message.kind == "exit":
            return
        asked = int(counter.read_text()) + 1 if counter.exists() else 1
        counter.write_text(str(asked))
        if asked == int(at.rstrip("+")) or (at.endswith("+") and asked > int(at[:-1])):
            if mode == "crash":
                os.write(2, b"something went wrong in C\n")
                os.kill(os.getpid(), 11)
            if mode == "hang":
                time.sleep(3600)
            if mode == "refuse":
                send(Message(kind="error", fields={"what": "no such thing"}))
                continue
        send(
            Message(
                kind="echo", fields={**message.fields, "kind": message.kind}, arrays=message.arrays
            )
        )


main()
