"""Connections of the server: what has not shown the token counts little, and what goes on too slowly is closed."""

from __future__ import annotations

import asyncio
from typing import Any, ClassVar

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

PATIENCE = 10.0
"""Seconds that a request may take to be there, and its content to go on; and all that is asked without the token."""

CONNECTIONS = 64
"""The most connections at a time that have shown the token; further ones are answered by 503."""

STRANGERS = 32
"""The most that have not; the oldest of them is closed for another one."""


class Connection(H11Protocol):
    """A connection of HTTP, a stranger until a request of it shows the token."""

    _strangers: ClassVar[dict[Connection, None]] = {}
    """The oldest first."""

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        self._strangers[self] = None
        self._late: asyncio.TimerHandle | None = self.loop.call_later(PATIENCE, self.transport.abort)
        if len(self._strangers) > STRANGERS:
            next(iter(self._strangers)).transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self._leave()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if self.scope is not None and self.config.app.knows(self.scope):  # type: ignore[union-attr]  # ours, of whatever may be served
            self._strangers.pop(self, None)
        if self.transport.get_protocol() is not self:  # a socket now, or refused
            self._leave()
        elif self not in self._strangers:
            self._expect(self.conn.their_state)

    def _expect(self, state: Any) -> None:
        """Wait for the rest of a request: for all of its head, or for more of its content."""
        if state is not h11.IDLE:
            self._wait_no_more()
        if state in (h11.IDLE, h11.SEND_BODY) and self._late is None:
            self._late = self.loop.call_later(PATIENCE, self.transport.abort)

    def _wait_no_more(self) -> None:
        if self._late is not None:
            self._late.cancel()
            self._late = None

    def _leave(self) -> None:
        self._strangers.pop(self, None)
        self._wait_no_more()
