# The virtual environment of a guest in Python, from the requirements beside its Makefile.
PYTHON ?= python3

all: .venv

.venv: requirements.txt
	$(PYTHON) -m venv .venv
	.venv/bin/pip install --quiet --requirement requirements.txt
	@touch .venv

clean:
	rm -rf .venv

.PHONY: all clean
