"""Bodies that pass the parser of HTTP by, and packs cut out of them."""

import asyncio
import hashlib
import os
import socket
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import uvicorn
from hypothesis import given
from hypothesis import strategies as st
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse
from starlette.routing import Route

from app.imports.octets import Octets
from app.operation.large_bodies import LargeBodies


async def echo(request: Request) -> PlainTextResponse:
    """Answer with the SHA-256 of the body."""
    return PlainTextResponse(hashlib.sha256(await request.body()).hexdigest())


async def answers(sent: list[bytes], count: int) -> list[str]:
    """Send bytes over one connection, piece by piece; return the bodies of the answers."""
    listener = socket.create_server(("127.0.0.1", 0))
    app = Starlette(routes=[Route("/", echo, methods=["POST"])])
    server = uvicorn.Server(uvicorn.Config(app, http=LargeBodies, log_level="critical"))
    serving = asyncio.create_task(server.serve(sockets=[listener]))
    reader, writer = await asyncio.open_connection(*listener.getsockname())
    for piece in sent:
        writer.write(piece)
        await writer.drain()
        await asyncio.sleep(0)
    found = []
    while len(found) < count:
        head = await reader.readuntil(b"\r\n\r\n")
        if b" 100 " not in head.partition(b"\r\n")[0]:
            found.append((await reader.readexactly(64)).decode())
    writer.close()
    server.should_exit = True
    await serving
    return found


def test_large_bodies_arrive_whole_and_end_where_they_say() -> None:
    """Whatever pieces they come in, with another request close behind, chunked or waited for."""
    body = os.urandom(3_000_001)
    head = b"POST / HTTP/1.1\r\nHost: a\r\n"
    plain = head + b"Content-Length: %d\r\n\r\n" % len(body) + body
    waiting = head + b"Expect: 100-continue\r\nContent-Length: %d\r\n\r\n" % len(body) + body
    chunked = head + b"Transfer-Encoding: chunked\r\n\r\n" + b"%x\r\n" % len(body)
    stream = plain + plain + waiting + chunked + body + b"\r\n0\r\n\r\n" + plain
    cuts = [0, 10, 70, 71, 65_000, 2_999_990, 3_000_100, 4_000_000, 7_500_000, len(stream)]
    sent = [stream[begin:end] for begin, end in pairwise(cuts)]
    # A browser test before this one leaves an event loop running in the main thread.
    with ThreadPoolExecutor(1) as pool:
        found = pool.submit(lambda: asyncio.run(answers(sent, 5))).result(30)
    assert found == [hashlib.sha256(body).hexdigest()] * 5


@given(pieces=st.lists(st.binary(max_size=9), max_size=8), data=st.data())
def test_a_part_is_the_same_as_of_the_whole(pieces: list[bytes], data: st.DataObject) -> None:
    """Wherever the network cut a body, its parts are those of the joined bytes."""
    whole = b"".join(pieces)
    octets = Octets(pieces)
    assert (octets.size_bytes, octets.whole()) == (len(whole), whole)
    begin = data.draw(st.integers(0, len(whole)))
    end = data.draw(st.integers(begin, len(whole)))
    assert octets.part(begin, end) == whole[begin:end]
