# Every target does its own set-up on a fresh Debian or Ubuntu with a Rust toolchain, and says what it does.
.PHONY: help demo test docs docs-pdf notebooks soak fuzz bench pictures charts wheel clean

help:
	@echo "make demo    build, run the bank in ngspice here and through a server, compare, draw (out/demo)"
	@echo "make test    everything that must hold: format, lints, tests, documentation, Python, ngspice decks"
	@echo "make docs    the manual as a site (target/docs/html), links, spelling and sentences checked"
	@echo "make docs-pdf the manual as one PDF (target/docs/bimorph.pdf); not part of make test"
	@echo "make notebooks the pages of docs/start and docs/tutorials as Jupyter notebooks with their results (target/docs/notebooks)"
	@echo "make soak    a thousand sessions for a minute, ten thousand in turn, two hundred and fifty kills, hundreds of bits changed in files, a hundred killed clients, hundreds of failures of the network: what a server bears (some minutes)"
	@echo "make fuzz    any text as netlist, any bytes as layout, as messages to a server and as snapshots, ten minutes each (FUZZ_MINUTES)"
	@echo "make bench   measure (criterion)"
	@echo "make pictures draw the scenes and the figures of docs/project/paper.md (docs/pictures)"
	@echo "make charts  draw the charts of the README from counted work (docs/pictures); scripts/charts --time measures"
	@echo "make wheel   the Python package with the command, the plug-in and models in process in it, tried with every Python here (out/wheel)"
	@echo "make clean   remove everything that was built"

demo:
	@scripts/setup ngspice build
	@examples/bank/demo

test:
	@scripts/setup ngspice versions
	@scripts/check

docs:
	@scripts/docs

docs-pdf:
	@scripts/docs-pdf

notebooks:
	@scripts/setup ngspice build python
	@.venv/bin/python scripts/notebooks

soak:
	@scripts/setup build
	cargo test --release --no-default-features --test device_contract
	cargo test --release --test service -- --ignored --nocapture --test-threads=1 soak:: session_faults::soak sweep_faults::soak
	cargo test --release --test cli -- --ignored --nocapture --test-threads=1 damage::soak stored_sessions::soak killed_clients::soak killed_jobs::soak

fuzz:
	@scripts/setup build
	cargo test --release --workspace --test fuzz --test fuzz_layouts -- --ignored --nocapture --test-threads=1
	cargo test --release --test service -- --ignored --nocapture --test-threads=1 fuzz::

bench:
	@scripts/setup build
	cargo bench --workspace

pictures:
	@scripts/setup build
	@scripts/pictures

charts:
	@scripts/setup build
	@scripts/charts

# The Python package with the command, the plug-in and models in process of this machine (out/wheel).
wheel:
	@scripts/wheel

clean:
	rm -rf target out .venv
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
