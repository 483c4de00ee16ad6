"""A server, and the models compiled on it."""

from __future__ import annotations

import os
import uuid
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from . import arguments
from . import sweep as sweeps
from .access import Access
from .aloud import of_netlist
from .channel import Channel
from .conversion import LAYOUTS, Conversion, LayoutWarning, Piece
from .errors import InvalidRequest, NetlistError
from .local import ADDRESS, LocalChannel
from .messages import diagnostic, options_to_wire
from .model import Model
from .naming import by_argument
from .netlist import Netlist
from .options import Options
from .session import Session, resumed
from .stopping import apart
from .sweep_handle import Sweep, SweepStatus, status_of
from .sweep_wire import to_wire
from .table import Table
from .ticket import Ticket
from .v1 import jobs_pb2, model_pb2

if TYPE_CHECKING:
    from typing_extensions import Unpack


class Client:
    """Connection to a server.

    ``address`` is ``unix:///path``, ``host:port`` or, with TLS, ``https://host:port``; ``local:`` is this process (:func:`local`).
    ``timeout`` [s] bounds each unary call. The connection is opened at first use, again in each process: a client may be used after a fork, and
    sent to worker processes.

    ``ca`` is a file (PEM) with the authorities to trust at ``https://``. ``token`` is the token, or ``token_file`` a file with it.
    ``client_cert`` and ``client_key`` are for servers that require a certificate. Omitted values are taken from the environment:
    ``BIMORPH_CA``, ``BIMORPH_TOKEN_FILE``, ``BIMORPH_CLIENT_CERT``, ``BIMORPH_CLIENT_KEY``.
    """

    def __init__(
        self,
        address: str,
        timeout: float = 120.0,
        *,
        ca: str | os.PathLike[str] | None = None,
        token: str | None = None,
        token_file: str | os.PathLike[str] | None = None,
        client_cert: str | os.PathLike[str] | None = None,
        client_key: str | os.PathLike[str] | None = None,
    ) -> None:
        arguments.text("address", address, "the address of a server")
        timeout = arguments.timeout("timeout", timeout)
        named = {"ca": ca, "token_file": token_file, "client_cert": client_cert, "client_key": client_key}
        files = {name: None if file is None else arguments.path(name, file, "the path of a file") for name, file in named.items()}
        shown = None if token is None else arguments.token("token", token)
        if address == ADDRESS:
            self._channel: Channel = LocalChannel()
            return
        self._channel = Channel(address, timeout, Access(**files, token=shown))

    @property
    def address(self) -> str:
        """Address as given."""
        return self._channel.address

    def version(self) -> str:
        """Version of the server."""
        return str(self._channel.call("Info", model_pb2.InfoRequest()).version)

    def settings(self) -> dict[str, str]:
        """All settings of the server, defaults included, by the names of docs/reference/server.md."""
        return {s.name: s.value for s in self._channel.call("Info", model_pb2.InfoRequest()).settings}

    def convert(
        self,
        layout: str | os.PathLike[str],
        *,
        process: str | os.PathLike[str] | None = None,
        cell: str | None = None,
    ) -> Conversion:
        """Converts a layout (.cif or .gds) into a netlist.

        ``process`` is a process of the server ("polymumps", "soi") or the path of a process file. By default the layout names its process.
        ``cell`` is the cell to read if several cells are not instances of another one.
        """
        path = Path(arguments.path("layout", layout, "the path of a layout"))
        text = "" if process is None else arguments.path("process", process, "the name of a process or the path of its file")
        cell = None if cell is None else arguments.text("cell", cell, "the name of a cell")
        if text and Path(text).suffix:
            text = arguments.content("process", text).decode("utf-8", errors="replace") + "\n"
        request = model_pb2.ConvertRequest(
            name=str(path), layout=arguments.content("layout", path), process=text, cell=cell or ""
        )
        answer = self._channel.call("Convert", request)
        return Conversion(
            netlist=Netlist(answer.bundle.root, dict(answer.bundle.files)),
            process=answer.process,
            by=answer.by,
            drawn_m2=answer.drawn_m2,
            extracted_m2=answer.extracted_m2,
            anchored_m2=answer.anchored_m2,
            unrecognised_m2=answer.unrecognised_m2,
            unrecognised=tuple(
                Piece(u.layer, u.area_m2, (u.left_m, u.bottom_m, u.right_m, u.top_m), u.why) for u in answer.unrecognised
            ),
            notes=tuple(answer.notes),
        )

    def compile(
        self,
        netlist: str | os.PathLike[str] | Netlist,
        *,
        set: Mapping[str, float | str] | None = None,
        include: Iterable[str | os.PathLike[str]] = (),
        **options: Unpack[Options],
    ) -> Model:
        """Compiles a netlist (a path, or a :class:`Netlist`), or a layout (.cif or .gds) by :meth:`convert`.

        Issues :class:`LayoutWarning` for areas that the conversion did not recognise and for its approximations, and :class:`NetlistWarning` for
        warnings of the netlist.

        ``set`` overrides netlist parameters [SI]. The other keywords are the :class:`Options` of a model, such as ``tol`` and ``band``. A value
        outside its range is rejected.

        Raises :class:`NetlistError` with all diagnostics.
        """
        wire = options_to_wire(set, options)
        bundle = self._bundle(netlist, include)
        request = model_pb2.CompileRequest(bundle=bundle, options=wire)
        try:
            answer = self._channel.call("Compile", request)
        except InvalidRequest as error:
            # A status has no space for many diagnostics; Check returns all of them as data.
            checked = self._channel.call("Check", model_pb2.CheckRequest(bundle=bundle, options=wire))
            if checked.ok:
                raise
            diagnostics = [diagnostic(d) for d in checked.diagnostics]
            raise NetlistError(checked.rendered, error.violations, diagnostics) from None
        model = Model(self._channel, answer.model, request)
        of_netlist(model.warnings)
        return model

    def sweep(
        self,
        netlist: str | os.PathLike[str] | Netlist,
        parameters: sweeps.Axes,
        analysis: sweeps.Analysis,
        *,
        set: Mapping[str, float | str] | None = None,
        include: Iterable[str | os.PathLike[str]] = (),
        samples: sweeps.Samples | None = None,
        shard: tuple[int, int] = (0, 1),
        progress: Callable[[int, int], object] | None = None,
        **options: Unpack[Options],
    ) -> Table:
        """Runs ``analysis`` on the full grid of ``parameters``, on all cores of the server: netlist parameters [SI], voltages of ports (``"heat.v"``
        [V]) and options of the model (``"option.tol"``) by name. Names in a tuple vary together: ``{("w", "gap"): [(2e-6, 1e-6), (1.8e-6, 1.2e-6)]}``
        is one axis with a list of points.

        ``samples`` are drawn at every point of the grid, which may be empty (``{}``): Monte Carlo.
        ``shard`` (i, n) runs only points whose number modulo n is i. ``progress`` is called with (points done, points).

        Raises :class:`NoResult` if no point of the whole sweep has a result. Otherwise a point without a result is a row with its ``error``.
        """
        arguments.function("progress", progress)
        with self.submit(
            netlist, parameters, analysis, set=set, include=include, samples=samples, shard=shard, **options
        ) as running:
            return running.wait(progress)

    def submit(
        self,
        netlist: str | os.PathLike[str] | Netlist,
        parameters: sweeps.Axes,
        analysis: sweeps.Analysis,
        *,
        set: Mapping[str, float | str] | None = None,
        include: Iterable[str | os.PathLike[str]] = (),
        samples: sweeps.Samples | None = None,
        shard: tuple[int, int] = (0, 1),
        share: bool = False,
        release_after: float | None = None,
        **options: Unpack[Options],
    ) -> Sweep:
        """Starts a :meth:`sweep` and returns at once. ``wait()`` returns its table. :meth:`attach` finds it by its ``id``, after a restart of the
        server too if that has a folder for states.

        ``share`` reuses a running or finished sweep that this client submitted with ``share`` for the same netlist, options, points and
        ``release_after``. ``release_after`` [s] allows the server to cancel the sweep after that time without a connection of this client; None:
        it continues.
        """
        if release_after is not None:
            release_after = arguments.number("release_after", release_after, "None or a time in seconds", above=0.0)
        share = arguments.flag("share", share)
        spec, wire = to_wire(parameters, analysis, shard, samples), options_to_wire(set, options)
        request = jobs_pb2.SubmitJobRequest(
            bundle=self._bundle(netlist, include),
            options=wire,
            sweep=spec,
            # a repeated request after a lost reply starts no second sweep
            request_id="" if share else uuid.uuid4().hex,
            share=share,
            release_after_s=release_after or 0.0,
        )
        with apart(), by_argument("SubmitJob"):
            job = self._channel.persist(lambda: self._channel.call("SubmitJob", request))
        return Sweep(self._channel, job.name, share, is_part=spec.shards > 1)

    def attach(self, sweep: str) -> Sweep:
        """A sweep of this server by its ``id``, with or without ``jobs/``.

        Raises :class:`NotFound` if the server does not have it.
        """
        arguments.text("sweep", sweep, "the id of a sweep")
        found = Sweep(self._channel, sweep if "/" in sweep else f"jobs/{sweep}", shared=True)
        with by_argument("GetJob"):
            found.status()
        return found

    def sweeps(self) -> list[SweepStatus]:
        """Sweeps of this client on the server, the last one first. Clients are distinguished by token or certificate. All connections over a Unix
        socket are one client, and so are all without credentials."""
        found, token = list[SweepStatus](), ""
        while True:
            page = self._channel.call("ListJobs", jobs_pb2.ListJobsRequest(page_token=token))
            found += map(status_of, page.jobs)
            token = page.next_page_token
            if not token:
                return found

    def _bundle(self, netlist: str | os.PathLike[str] | Netlist, include: Iterable[str | os.PathLike[str]]) -> Any:
        if not isinstance(netlist, Netlist):
            netlist = arguments.path("netlist", netlist, "a path or a Netlist")
        if not isinstance(netlist, Netlist) and Path(netlist).suffix.lower() in LAYOUTS:
            converted = self.convert(netlist)
            for remark in converted.remarks():
                warnings.warn(f"{netlist}: {remark}", LayoutWarning, stacklevel=4)
            netlist = converted.netlist
        read = netlist if isinstance(netlist, Netlist) else Netlist._read("netlist", netlist, include)
        return model_pb2.Bundle(root=read.root, files=dict(read.files))

    def resume(self, ticket: Ticket, timeout: float = 60.0) -> Session:
        """Continues a kept session from its :meth:`Session.ticket`, also after a restart of the server.

        Raises :class:`NotFound` if the server does not have the session, and :class:`NoResult` if its states are of another version
        of the server. A failed call does not change the kept session.
        """
        ticket = arguments.instance("ticket", ticket, Ticket, "a Ticket, as Session.ticket() gives it")
        return resumed(self._channel, ticket, arguments.timeout("timeout", timeout))

    def close(self) -> None:
        """Closes the connection. The client may be used again."""
        self._channel.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def local() -> Client:
    """A client of models in this process, without server and network. Calls and errors are those of a server, and results are bit-identical. A step of
    a small model costs some ten microseconds. Analyses release the interpreter lock.

    A crash of the engine ends this process. Use a server where the caller must survive it.

    Raises :class:`BimorphError` if the package was installed without the native module (``make wheel`` includes it).
    """
    return Client(ADDRESS)
