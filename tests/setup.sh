# Functions that examples/demo.sh and tests/check.sh share (to be sourced): Debian packages and build.

# What the library, the program and the demo need.
demo_packages="build-essential gfortran cmake ninja-build pkg-config libfftw3-dev libnetcdf-dev
    libcyaml-dev libyaml-dev libcairo2-dev gnuplot-nox fonts-dejavu-core"
# What the tests need in addition.
test_packages="libcmocka-dev netcdf-bin python3-mdanalysis binutils"

# missing_packages NAME...: those that are not installed, on one line.
missing_packages() {
    local name
    for name in "$@"; do
        if [ "$(dpkg-query -W -f '${db:Status-Status}' "$name" 2>/dev/null)" != installed ]; then
            printf '%s ' "$name"
        fi
    done
}

# as_root COMMAND...: through sudo when the user is not root; fails when there is no sudo.
as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif command -v sudo >/dev/null; then
        sudo "$@"
    else
        return 1
    fi
}

# install_packages NAME...: installs what is missing; without network nothing happens when all is
# there. Ends the script with one line that names what is lacking when it cannot be installed.
install_packages() {
    if ! command -v dpkg-query >/dev/null; then
        echo "not a Debian system: going on with what is installed; needed are:" "$@"
        return
    fi
    local missing
    missing=$(missing_packages "$@")
    if [ -z "$missing" ]; then
        return
    fi
    echo "installing with apt: $missing"
    as_root apt-get update -q || true
    # shellcheck disable=SC2086
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends \
        $missing || true
    missing=$(missing_packages "$@")
    if [ -n "$missing" ]; then
        echo "cannot go on, these Debian packages are lacking and could not be installed: $missing" >&2
        exit 1
    fi
}
