#!/usr/bin/env bash
# Asks the npm package in a headless Chromium: both builds, workers, and a file that is missing. Prints "Skipped: ..." and ends
# with 0 where Chromium, its driver, Emscripten or node is not installed.
#
#   bindings/web/test/browser.sh [--built]    --built: the package is there already
set -euo pipefail
case ${1-} in
  '' | --built) ;;
  *) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2 && exit 2 ;;
esac
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
for program in chromium emcmake node npm; do
  command -v "$program" >/dev/null || { echo "Skipped: $program is not installed (tools/setup.sh pages web)" && exit 0; }
done
[[ ${1-} == --built ]] || bindings/web/build.sh
served=$(mktemp -d)
jobs=()
clean_up() {
  ((${#jobs[@]} == 0)) || kill "${jobs[@]}" 2>/dev/null || true
  wait
  rm -rf "$served"
}
trap clean_up EXIT
cp -r build/web/nifkit "$served"
cp bindings/web/test/browser.html "$served"
cp tests/golden/v2-exact.nif "$served/asset.nif"
# Prints the port that the system chooses, then what the page has to say, and ends.
python3 -u - "$served" >"$served/said" 2>"$served/log" <<'END' &
import functools, http.server, sys
class Pages(http.server.SimpleHTTPRequestHandler):
    extensions_map = http.server.SimpleHTTPRequestHandler.extensions_map | {".mjs": "text/javascript"}
    def do_POST(self):
        print(self.rfile.read(int(self.headers["Content-Length"])).decode())
        self.send_response(204)
        self.end_headers()
        self.server.heard = True
server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Pages, directory=sys.argv[1]))
server.heard = False
print(server.server_address[1])
while not server.heard:
    server.handle_request()
END
server=$!
jobs+=("$server")
for _ in {1..100}; do
  [[ ! -s $served/said ]] || break
  sleep 0.1
done
chromium --headless --no-sandbox --disable-gpu --user-data-dir="$served/profile" \
  "http://127.0.0.1:$(<"$served/said")/browser.html" 2>>"$served/log" &
jobs+=("$!")
for _ in {1..600}; do
  (($(wc -l <"$served/said") < 2)) || break
  sleep 0.1
done
said=$(sed -n '2,$p' "$served/said")
if [[ $said != 'as it should be' ]]; then
  echo "bindings/web/test/browser.sh: the page says: ${said:-nothing}" >&2
  tail -n 20 "$served/log" >&2
  exit 1
fi
echo 'nifkit answers in Chromium as it should'
