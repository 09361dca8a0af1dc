# slosh_ros from a bare machine: Python 3.10-3.13, make and pip are enough. `make` lists the targets.
#
# The packages go into .venv, ROS 2 Jazzy among them as wheels. In a shell where a ROS 2 Jazzy is
# sourced, .venv stands on that one instead and adds only what is missing.
SHELL := /bin/bash
PYTHON ?= python3
RUN := .venv/bin/python -m

# Nodes started here talk only to this machine, and on a domain (1..101) that is this checkout's.
export ROS_AUTOMATIC_DISCOVERY_RANGE ?= LOCALHOST
ifndef ROS_DOMAIN_ID
export ROS_DOMAIN_ID := $(shell set -- $$(cksum <<< '$(CURDIR)'); echo $$(($$1 % 101 + 1)))
endif
export ROS_LOG_DIR ?= $(CURDIR)/build/ros_log
# The matrices here are small: threads only wait for each other, fivefold on a busy machine.
export OPENBLAS_NUM_THREADS ?= 1

# An environment is complete once its stamp is there. The stamp tells ROS and Python, so that
# another of either makes it anew.
KIND := $(or $(ROS_DISTRO),wheels)
STAMP := .venv/.complete-$(KIND)-$(subst /,_,$(PYTHON))
OLDEST := .venv-oldest/.complete
MAKE_VENV := requirements/make_venv.sh
# Files of tests on all cores, each worker with a ROS domain of its own (test/conftest.py). Half as
# many workers again as there are cores: nodes wait for each other most of the time.
SHARED_OUT := -n $(shell echo $$(($$(getconf _NPROCESSORS_ONLN) * 3 / 2))) --dist loadfile

.PHONY: help venv demo test lint format bench soak docs colcon test-oldest bags clean

help: ## list the targets
	@sed -nE 's/^([a-z-]+):.*## (.*)/\1 \2/p' Makefile | \
	  while read -r target text; do printf 'make %-12s %s\n' "$$target" "$$text"; done

venv: $(STAMP) ## make .venv, with slosh and the nodes in .venv/bin

demo: $(STAMP) ## the main job: a closed loop of two ROS nodes, the replay of a real drive, a rollover margin
	$(RUN) slosh_ros.study.demo --out demo_output

test: $(STAMP) ## the whole test suite (PYTEST='-k NAME' for a part of it)
	$(RUN) pytest $(SHARED_OUT) $(PYTEST)

# ament_flake8 and ament_pep257 are Jazzy's own and hold the code to ROS 2's style. Left out are
# ament_xmllint, which fetches its schema at each run (a test validates package.xml), ament_mypy,
# which only wraps mypy, and ament_copyright, of which there is no wheel. The mood of a summary (D401)
# is left to ruff, which knows properties.
lint: $(STAMP) ## ruff (rules and format), mypy --strict, ament_flake8, ament_pep257
	$(RUN) ruff check
	$(RUN) ruff format --check
	$(RUN) mypy
	$(RUN) ament_flake8.main --config setup.cfg slosh_ros launch setup.py
	$(RUN) ament_pep257.main --add-ignore D401 D413 -- slosh_ros launch setup.py

format: $(STAMP) ## let ruff write the code as lint wants it
	$(RUN) ruff check --fix
	$(RUN) ruff format

bench: $(STAMP) ## what it all costs, against a bare relay node, reading a bag, Basilisk (build/bench.json)
	@$(RUN) pip install -q -r requirements/bench.txt || echo 'without Basilisk, which cannot be installed here'
	.venv/bin/python bench/run.py

soak: $(STAMP) ## a million samples through the engine, a hundred thousand through slosh_node: memory, losses
	.venv/bin/python bench/soak.py

docs: $(STAMP) ## the manual as HTML, warnings are errors; open build/docs/index.html
	$(RUN) sphinx -W --keep-going -n -q -E -b html docs build/docs

colcon: $(STAMP) ## build and test as in a ROS workspace; then `source install/setup.bash`
	$(RUN) colcon build --base-paths .
	$(RUN) colcon test --base-paths . --event-handlers console_direct+ --return-code-on-test-failure

test-oldest: $(OLDEST) ## the tests that need no ROS, on the oldest versions (Ubuntu 24.04's)
	@! $(NO_ROS) .venv-oldest/bin/python -c 'import rclpy' 2>/dev/null || \
	  { echo 'error: there is an rclpy in .venv-oldest' >&2; exit 1; }
	$(NO_ROS) .venv-oldest/bin/python -m pytest $(SHARED_OUT) -m 'not ros and not colcon and not dear' $(PYTEST)

bags: $(STAMP) ## make bags/ anew from the recordings in ../shared/data
	.venv/bin/python bags/make_bags.py --force

clean: ## remove all that make has made
	rm -rf .venv .venv-oldest build install log demo_output *.egg-info
	find . -name '__pycache__' -prune -exec rm -rf {} + -o -name '.*_cache' -prune -exec rm -rf {} + \
	  -o -name .hypothesis -prune -exec rm -rf {} +

$(STAMP): $(filter-out %/oldest.txt,$(wildcard requirements/*)) setup.py
	@$(MAKE_VENV) '$(PYTHON)' $(KIND) $@

$(OLDEST): requirements/oldest.txt $(MAKE_VENV) setup.py
	@$(MAKE_VENV) '$(PYTHON_OLDEST)' oldest $@

# 3.12 is Ubuntu 24.04's. A pyenv has it under a path only; its python3.12 need not run.
PYTHON_OLDEST ?= $(shell for python in python3.12 ~/.pyenv/versions/3.12*/bin/python python3.11 python3.10; \
  do $$python -c '' 2>/dev/null && echo $$python && exit; done; echo python3)
NO_ROS := env -u PYTHONPATH -u LD_LIBRARY_PATH -u AMENT_PREFIX_PATH
