# Two commands do everything, set-up included: `make demo` and `make test`.
# Both build the release profile, so that whoever runs one has most of the other built.

CARGO ?= cargo

.PHONY: demo test bench lint docs setup

demo: setup
	TESSCLIP_COMMIT=$$(git rev-parse --short HEAD 2>/dev/null) $(CARGO) build --release --locked
	./target/release/tessclip demo --out demo-out

test:
	@scripts/setup.sh window
	$(CARGO) test --release --locked

bench:
	@scripts/setup.sh window
	$(CARGO) bench --locked

lint:
	$(CARGO) fmt --check
	$(CARGO) clippy --release --locked --all-targets -- -D warnings
	$(CARGO) clippy --release --locked --no-default-features --lib -- -D warnings
	$(CARGO) clippy --release --locked --no-default-features --features cli --bins -- -D warnings

docs:
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --release --locked --no-deps

setup:
	@scripts/setup.sh
