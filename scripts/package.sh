#!/usr/bin/env bash
# Builds packages of Lucerna.
# usage: scripts/package.sh [--archive] [FOLDER]     FOLDER: where the packages go; default: build/debian, build/archive
#   (nothing)  the Debian packages lucerna and liblucerna-dev, which lintian checks, of what git has of this tree (committed or not)
#   --archive  lucerna-VERSION-ARCHITECTURE.tar.zst of build/release: the command with the libraries that it needs, to be unpacked on any Linux
#              system with the C library of this one or a newer one. Nothing else needs to be installed there, except Open MPI for
#              renders by several processes.
set -euo pipefail
cd "$(dirname "$0")/.."
kind=debian
[ "${1:-}" != --archive ] || { kind=archive && shift; }
case ${1:-} in
    -*) sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "$0" && exit ;;
esac
folder=${1:-build/$kind}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)

bash scripts/deps.sh product
bash scripts/deps.sh package

if [ $kind = debian ]; then
    rm -rf "$folder/source"
    mkdir "$folder/source"
    git ls-files -z | tar --null -T - -cf - | tar -C "$folder/source" -xf -
    (cd "$folder/source" && dpkg-buildpackage -us -uc -b)
    rm -rf "$folder/source"
    lintian --fail-on error,warning "$folder"/lucerna_*.changes
    ls "$folder"/*.deb
    exit
fi

[ -f build/release/CMakeCache.txt ] || cmake --preset release -DLUCERNA_TESTS=OFF --log-level=NOTICE >/dev/null
cmake --build --preset release --target lucerna
name=lucerna-$(sed -n 's/^project(lucerna VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)-$(uname -m)
tree=$folder/$name
rm -rf "$tree"
cmake --install build/release --prefix "$tree" --strip --component program >/dev/null

# The libraries beside the program: all but those of the C library, which belong to the running system, and Open MPI,
# which has to be that of the launcher.
modules=("$tree"/lib/lucerna/*.so)
ldd "$tree/bin/lucerna" $(printf '%s\n' "${modules[@]}" | grep -v mpi) | awk '$2 == "=>" && $3 ~ /^\// { print $3 }' | sort -u |
    grep -vE '/(ld-linux.*|lib(c|m|dl|rt|pthread|resolv|util|anl|nsl|nss_.*|mvec|BrokenLocale))\.so' |
    while read -r library; do cp -L "$library" "$tree/lib/lucerna/"; done
find "$tree/lib/lucerna" -name '*.so*' ! -name 'liblucerna_*' -exec patchelf --set-rpath '$ORIGIN' {} +
patchelf --set-rpath '$ORIGIN' "${modules[@]}"
mkdir -p "$tree/lib/lucerna/fonts" "$tree/share/doc/lucerna"
cp /usr/share/fonts/truetype/dejavu/DejaVuSans{,-Bold}.ttf "$tree/lib/lucerna/fonts/"
cp LICENSE README.md "$tree/share/doc/lucerna/"
# Their licences, by package.
(cd "$tree/lib/lucerna" && dpkg-query -S $(printf '*/%s\n' *.so* | grep -v liblucerna_) 2>/dev/null || true) | cut -d: -f1 | sort -u | while read -r package; do
    copyright=/usr/share/doc/$package/copyright
    [ ! -f "$copyright" ] || cp -L "$copyright" "$tree/share/doc/lucerna/$package.copyright"
done
tar -C "$folder" --zstd --sort=name --owner=0 --group=0 --numeric-owner -cf "$tree.tar.zst" "$name"
ls -l "$tree.tar.zst"
