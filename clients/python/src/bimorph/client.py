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
    """A server.

    ``address`` is ``unix:///path``, ``host:port`` or, with TLS, ``https://host:port``; ``local:`` is this process (:func:`local`).
    ``timeout`` [s] bounds each unary call. The
    connection is made when it is first needed, again in each process: a client may be used after a fork, and sent to worker
    processes.

    ``ca`` is a file (PEM) of the authorities to trust at ``https://``; ``token_file`` holds the token to show, or ``token`` is it;
    ``client_cert`` and ``client_key`` are for servers that ask for a certificate. Those left out are taken from the environment:
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
        """Everything that the server was told, or does by default, by the names of docs/service.md."""
        return {s.name: s.value for s in self._channel.call("Info", model_pb2.InfoRequest()).settings}

    def convert(
        self,
        layout: str | os.PathLike[str],
        *,
        process: str | os.PathLike[str] | None = None,
        cell: str | None = None,
    ) -> Conversion:
        """Makes a netlist of a layout (.cif or .gds).

        ``process`` is the name of one that the server has ("polymumps", "soi") or the path of a process file; without it the drawing
        names its own. ``cell`` is the cell to read where several are called by no other.
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
        """Compiles a netlist (a path, or a :class:`Netlist`), or a layout (.cif or .gds), which :meth:`convert` makes a netlist of.

        What the conversion has to tell, areas not understood above all, comes as :class:`LayoutWarning`, what the netlist is warned of as
        :class:`NetlistWarning`, and what results are warned of as :class:`AccuracyWarning`.

        ``set`` overrides netlist parameters [SI]. The other keywords are the :class:`Options` of a model, such as ``tol``
        and ``band``; the server refuses a value beyond its range.

        Raises :class:`NetlistError` with all diagnostics.
        """
        wire = options_to_wire(set, options)
        bundle = self._bundle(netlist, include)
        request = model_pb2.CompileRequest(bundle=bundle, options=wire)
        try:
            answer = self._channel.call("Compile", request)
        except InvalidRequest as error:
            # A status has no room for many diagnostics; Check gives all of them, as data.
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
        [V]) and options of the model (``"option.tol"``) by name. Names in a tuple go together: ``{("w", "gap"): [(2e-6, 1e-6), (1.8e-6, 1.2e-6)]}``
        is a list of points, and an axis like any other.

        ``samples`` are drawn at every point of the grid, which may be empty (``{}``): Monte Carlo.
        ``shard`` (i, n) runs only points whose number modulo n is i. ``progress`` is called with (points done, points).

        Raises :class:`NoResult` where no point of the whole sweep has a result; a point without one beside others is a row with its ``error``.
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
        """Starts a :meth:`sweep` and comes back at once: ``wait()`` has its table, and its ``id`` finds it again (:meth:`attach`), on a server
        with a folder for states also when that was started anew.

        With ``share`` it is the sweep that this client submitted with ``share`` for the same netlist, options, points and ``release_after``,
        running or done, if the server has one. ``release_after`` [s] lets the
        server cancel it when it has had no connection of this client for so long; None: it runs on.
        """
        if release_after is not None:
            release_after = arguments.number("release_after", release_after, "None or a time in seconds", above=0.0)
        share = arguments.flag("share", share)
        spec, wire = to_wire(parameters, analysis, shard, samples), options_to_wire(set, options)
        request = jobs_pb2.SubmitJobRequest(
            bundle=self._bundle(netlist, include),
            options=wire,
            sweep=spec,
            # an answer that is lost starts no second sweep
            request_id="" if share else uuid.uuid4().hex,
            share=share,
            release_after_s=release_after or 0.0,
        )
        with apart(), by_argument("SubmitJob"):
            job = self._channel.persist(lambda: self._channel.call("SubmitJob", request))
        return Sweep(self._channel, job.name, share, is_part=spec.shards > 1)

    def attach(self, sweep: str) -> Sweep:
        """A sweep of this server by its ``id``, with or without ``jobs/``.

        Raises :class:`NotFound` for one that the server does not have (any more).
        """
        arguments.text("sweep", sweep, "the id of a sweep")
        found = Sweep(self._channel, sweep if "/" in sweep else f"jobs/{sweep}", shared=True)
        with by_argument("GetJob"):
            found.status()
        return found

    def sweeps(self) -> list[SweepStatus]:
        """The sweeps that this client has on the server, the last one first: the owner of a token or of a certificate sees its own; all who
        come by a Unix socket are one client, and all who show nothing."""
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
            for said in converted.told():
                warnings.warn(f"{netlist}: {said}", LayoutWarning, stacklevel=4)
            netlist = converted.netlist
        read = netlist if isinstance(netlist, Netlist) else Netlist._read("netlist", netlist, include)
        return model_pb2.Bundle(root=read.root, files=dict(read.files))

    def resume(self, ticket: Ticket, timeout: float = 60.0) -> Session:
        """Goes on with a kept session from its :meth:`Session.ticket`, also when the server was started anew.

        Raises :class:`NotFound` when the session is not kept (any more), :class:`NoResult` when its states are of another version
        of the server. Whatever this raises, what is kept stays.
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
    """Models in this process: no server and no network, the same calls, bits and errors as with one. A step of a small model costs
    some ten microseconds, and analyses let other threads run.

    A fault in the process is one of the program's; what must go on regardless belongs on a server.

    Raises :class:`BimorphError` where the package was installed without it (``make wheel``).
    """
    return Client(ADDRESS)
