#!/usr/bin/env python3
"""Writes a software bill of materials of nifkit: SPDX 2.3 as JSON.

It lists the libraries that the programs are built with: those that tools/setup.sh installs for the group `build`, in the
versions that are installed here, under the licences that NOTICE states. The runtime alone (--tools OFF) is only compiled with
Highway's headers.

  packaging/sbom.py --version 0.1.0 --cgal ON --tools ON --output nifkit.spdx.json

Its time is SOURCE_DATE_EPOCH, or now.
"""
import argparse
import datetime
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Debian's package, and the line in NOTICE that names its licence. Compilers and build tools are in BUILD_TOOLS.
LIBRARIES = {
    "libembree-dev": "Embree",
    "libtbb-dev": "oneTBB",
    "libhwy-dev": "Highway",
    "libdraco-dev": "Draco",
    "libtinygltf-dev": "tinygltf",
    "nlohmann-json3-dev": "JSON for Modern C++",
    "zlib1g-dev": "zlib",
    "libzstd-dev": "Zstandard",
    "libxxhash-dev": "xxHash",
    "libfmt-dev": "{fmt}",
    "libcli11-dev": "CLI11",
    "libtomlplusplus-dev": "toml++",
    "libpng-dev": "libpng",
    "libjpeg62-turbo-dev": "libjpeg-turbo",
    "libwebp-dev": "libwebp",
    "libopenexr-dev": "OpenEXR",
    "libstb-dev": "stb_image",
    "libopenmesh-dev": "OpenMesh",
    "libmeshoptimizer-dev": "meshoptimizer",
    "libopenvdb-dev": "OpenVDB",
    "libboost-iostreams-dev": "Boost",
    "libcgal-dev": "CGAL",
}
BUILD_TOOLS = {"g++", "cmake", "ninja-build", "python3"}

# NOTICE's wording and the names in SPDX.
LICENCES = {
    "IJG and BSD": "IJG AND BSD-3-Clause AND Zlib",
    "MIT, exception": "MIT",
    "MIT or public": "MIT",
    "zlib": "Zlib",
}


def build_packages():
    """The names in tools/setup.sh's group `build`."""
    text = (ROOT / "tools/setup.sh").read_text()
    return re.findall(r"^build +(\S+)", text, re.MULTILINE)


def licences():
    """Licences by library, as NOTICE states them in its table."""
    found = {}
    for line in (ROOT / "NOTICE").read_text().splitlines():
        row = re.match(r"  (\S.*?) {1,}[\d.]* {2,}(\S.*?) {2,}\S", line) or re.match(r"  (\S.*?) [\d.]+ +(\S.*?)  +\S", line)
        if row:
            name = re.sub(r" \d[\d.]*$", "", row[1])
            found.setdefault(name, LICENCES.get(row[2], row[2]))
    return found


def installed_version(package):
    """Debian's version; None if it is not installed, or this is not Debian."""
    try:
        answer = subprocess.run(
            ["dpkg-query", "-W", "-f=${Version}", package], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return None
    return answer.stdout if answer.returncode == 0 and answer.stdout else None


def created():
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    time = (datetime.datetime.fromtimestamp(int(epoch), datetime.timezone.utc) if epoch
            else datetime.datetime.now(datetime.timezone.utc))
    return time.strftime("%Y-%m-%dT%H:%M:%SZ")


def library(package, licence):
    version = installed_version(package)
    entry = {
        "SPDXID": "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", package),
        "name": LIBRARIES[package],
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "licenseConcluded": licence,
        "licenseDeclared": licence,
        "copyrightText": "NOASSERTION",
    }
    if version:
        entry["versionInfo"] = version
        entry["externalRefs"] = [{
            "referenceCategory": "PACKAGE-MANAGER",
            "referenceType": "purl",
            "referenceLocator": "pkg:deb/debian/%s@%s" % (package.replace("+", "%2B"), version),
        }]
    return entry


def bill(version, cgal, tools):
    unknown = [p for p in build_packages() if p not in LIBRARIES and p not in BUILD_TOOLS]
    if unknown:
        sys.exit("packaging/sbom.py: tools/setup.sh installs packages that this script does not know: " + ", ".join(unknown))
    known = licences()
    missing = [name for name in LIBRARIES.values() if name not in known]
    if missing:
        sys.exit("packaging/sbom.py: NOTICE states no licence for " + ", ".join(missing))
    used = [p for p in build_packages() if p in LIBRARIES and (tools or p == "libhwy-dev") and (cgal or p != "libcgal-dev")]
    licence = "GPL-3.0-or-later" if cgal and tools else "Apache-2.0"
    own = {
        "SPDXID": "SPDXRef-nifkit",
        "name": "nifkit",
        "versionInfo": version,
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "licenseConcluded": licence,
        "licenseDeclared": "Apache-2.0",
        "copyrightText": "Copyright the nifkit authors",
    }
    packages = [library(p, known[LIBRARIES[p]]) for p in used]
    return {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": "nifkit-" + version,
        "documentNamespace": "https://spdx.org/spdxdocs/nifkit-%s-%s" % (version, created()),
        "creationInfo": {"created": created(), "creators": ["Tool: nifkit-sbom"]},
        "packages": [own] + packages,
        "relationships": [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                           "relatedSpdxElement": "SPDXRef-nifkit"}]
        + [{"spdxElementId": "SPDXRef-nifkit", "relationshipType": "DEPENDS_ON", "relatedSpdxElement": p["SPDXID"]}
           for p in packages],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--version", required=True)
    parser.add_argument("--cgal", default="ON", help="whether CGAL is linked: ON or OFF")
    parser.add_argument("--tools", default="ON", help="whether the nif program is built: ON or OFF")
    parser.add_argument("--output", required=True)
    arguments = parser.parse_args()
    text = json.dumps(bill(arguments.version, arguments.cgal == "ON", arguments.tools == "ON"), indent=1) + "\n"
    pathlib.Path(arguments.output).write_text(text)


main()
