#!/usr/bin/env bash
# Runs commands in a Debian 12 that has nothing but its base system, on a copy of the last commit.
#   pristine.sh configure    ./soda.sh configure: the packages that it names are enough (minutes)
#   pristine.sh all          ./soda.sh run and ./soda.sh test, as root and as another user (an hour)
#   pristine.sh COMMAND      any shell command, as root, in the root folder of the project
# Needs root, mmdebstrap and a Debian mirror; the mirror is that of this machine's apt. The base
# system is kept in $SODA_PRISTINE_BASE (default: soda-pristine-bookworm.tar in the temporary folder).
# Exit code 77: cannot be done here, with the reason.
set -euo pipefail
project=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
base=${SODA_PRISTINE_BASE:-${TMPDIR:-/tmp}/soda-pristine-bookworm.tar}

skip() {
  echo "pristine.sh: skipped: $1"
  exit 77
}
(($# == 1)) || { echo "usage: pristine.sh configure | all | COMMAND" >&2; exit 2; }
((EUID == 0)) || skip "needs root"
for tool in mmdebstrap unshare chroot git; do
  command -v "$tool" >/dev/null || skip "no $tool"
done
unshare --mount --pid --fork mount --make-rprivate / 2>/dev/null ||
  skip "mount namespaces are not allowed"
git -C "$project" rev-parse -q --verify HEAD >/dev/null || skip "not a git checkout"

make_base() {
  local mirror
  mirror=$(apt-get indextargets --format '$(REPO_URI) $(CODENAME)' 'Created-By: Packages' |
    awk '$2 == "bookworm" { print $1; exit }')
  [[ -n $mirror ]] || skip "apt on this machine knows no Debian mirror"
  mmdebstrap --quiet --variant=minbase --include=ca-certificates,sudo bookworm "${base%.tar}-new.tar" "$mirror" ||
    skip "no base system from $mirror"
  mv "${base%.tar}-new.tar" "$base"
}
[[ -f $base ]] || make_base

root=$(mktemp -d "${TMPDIR:-/tmp}/soda-pristine.XXXXXX")
trap 'rm -rf --one-file-system "$root"' EXIT
tar -xf "$base" -C "$root"
for file in /etc/resolv.conf /etc/ssl/certs/ca-certificates.crt; do
  [[ ! -f $file ]] || cp "$file" "$root$file"
done
cp -r /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d/"
printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d" # packages start no services
chmod +x "$root/usr/sbin/policy-rc.d"
echo "127.0.0.1 localhost pristine" >"$root/etc/hosts"
mkdir "$root/srv/soda"
git -C "$project" archive HEAD | tar -x -C "$root/srv/soda"
cp -r "$root/srv/soda" "$root/srv/soda-user"

case $1 in
  configure) commands='./soda.sh configure' ;;
  all)
    commands='./soda.sh run && ./soda.sh test && useradd -m user && chown -R user /srv/soda-user &&
      cd /srv/soda-user && su user -c "./soda.sh run && ./soda.sh test"'
    ;;
  *) commands=$1 ;;
esac
export root commands
unshare --mount --pid --fork --ipc --uts bash -euc '
  mount --make-rprivate /
  mount --bind "$root" "$root" # a mount point, as the root of a machine is
  mount -t proc proc "$root/proc"
  mount --rbind /sys "$root/sys"
  mount --rbind /dev "$root/dev"
  mount -t tmpfs -o size=2g,mode=1777 tmpfs "$root/dev/shm"
  mount -t tmpfs -o mode=1777 tmpfs "$root/tmp"
  hostname pristine
  exec env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin TERM=dumb \
    LANG=C.UTF-8 chroot "$root" bash -euc "cd /srv/soda; $commands"'
