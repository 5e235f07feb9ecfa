#!/usr/bin/env bash
# Makes sure that a graphics adapter can be found; called by `make demo` and `make test`.
# On Debian and Ubuntu it installs Mesa's software Vulkan driver where no Vulkan driver is present. With the
# argument `window` also what the viewer's tests need: an X server without a screen, and keys and a mouse for it. What a
# window needs of X11 is installed in any case.
set -eu

[ "${TESSCLIP_NO_GPU:-}" = 1 ] && exit 0

if ! command -v cargo >/dev/null 2>&1; then
  echo "setup: cargo is missing: install a Rust toolchain (1.95 or newer) first" >&2
  exit 2
fi

case "$(uname -s)" in
  Linux) ;;
  *) exit 0 ;; # macOS and Windows bring Metal and DirectX 12 with the system
esac

need=""
command -v cc >/dev/null 2>&1 || need="$need gcc libc6-dev" # zstd is C, and Rust links with cc
# A Vulkan driver announces itself by a file in one of these folders, or by a variable. Drivers for hardware
# that is not there give no adapter: without any, only the software driver (lvp) counts.
has_driver() {
  [ -n "${VK_ICD_FILENAMES:-}${VK_DRIVER_FILES:-}" ] && return 0
  wanted="lvp_icd"
  for device in /dev/dri/renderD* /dev/nvidia0 /dev/dxg; do
    [ -e "$device" ] && wanted=""
  done
  for folder in /usr/share /usr/local/share /etc; do
    for file in "$folder"/vulkan/icd.d/"$wanted"*.json; do
      [ -e "$file" ] && return 0
    done
  done
  return 1
}
has_loader() {
  for file in /usr/lib/libvulkan.so.1 /usr/lib64/libvulkan.so.1 /usr/lib/*/libvulkan.so.1 /usr/local/lib/libvulkan.so.1; do
    [ -e "$file" ] && return 0
  done
  return 1
}
has_driver || need="$need mesa-vulkan-drivers"
has_loader || need="$need libvulkan1"
if [ "${1:-}" = window ]; then
  command -v Xvfb >/dev/null 2>&1 || need="$need xvfb"
  command -v xdotool >/dev/null 2>&1 || need="$need xdotool"
fi
# The window library opens these by name when a window opens, where there is an X server.
for pair in libX11-xcb.so.1=libx11-xcb1 libXcursor.so.1=libxcursor1 libXi.so.6=libxi6 \
  libXrandr.so.2=libxrandr2 libxkbcommon-x11.so.0=libxkbcommon-x11-0; do
  library="${pair%%=*}"
  found=""
  for file in /usr/lib/"$library" /usr/lib64/"$library" /usr/lib/*/"$library" /usr/local/lib/"$library"; do
    [ -e "$file" ] && found=1
  done
  [ -n "$found" ] || need="$need ${pair#*=}"
done
[ -z "$need" ] && exit 0

if ! command -v apt-get >/dev/null 2>&1; then
  echo "setup: missing:$need (names of Debian packages); install them with your package manager; the tests of the viewer need Xvfb and xdotool" >&2
  exit 2
fi
sudo=""
if [ "$(id -u)" != 0 ]; then
  if ! command -v sudo >/dev/null 2>&1; then
    echo "setup: please install as root: apt-get install$need" >&2
    exit 2
  fi
  sudo="sudo"
fi
echo "setup: installing$need"
$sudo apt-get update -qq
# shellcheck disable=SC2086 # a list of packages
DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends $need
