#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""tools/fetch_recordings against a server of this test's own: no network is needed, and none of the recordings is."""
import configparser
import hashlib
import http.server
import io
import os
import pathlib
import re
import socket
import subprocess
import tempfile
import threading
import unittest

import numpy
import scipy.io

ROOT = pathlib.Path(__file__).resolve().parents[2]
TOOL = ROOT / "tools" / "fetch_recordings"
LIST = ROOT / "tools" / "recordings.ini"


def sha256(content):
    return hashlib.sha256(content).hexdigest()


class Server:
    """Serves what `files` holds; breaks off halfway through what `torn` names; counts."""

    def __init__(self):
        self.files, self.torn, self.asked = {}, set(), []
        outer = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                outer.asked.append(self.path)
                content = outer.files.get(self.path)
                if content is None:
                    self.send_error(404)
                    return
                self.send_response(200)
                self.send_header("Content-Length", str(len(content)))
                self.end_headers()
                self.wfile.write(content[: len(content) // 2] if self.path in outer.torn else content)

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_address[1]}"
        threading.Thread(target=self.server.serve_forever, args=(0.01,), daemon=True).start()

    def close(self):
        self.server.shutdown()
        self.server.server_close()


class FetchRecordings(unittest.TestCase):
    def setUp(self):
        self.server = Server()
        self.folder = tempfile.TemporaryDirectory()
        self.to = pathlib.Path(self.folder.name) / "recordings"
        self.listed = configparser.ConfigParser(interpolation=None)

    def tearDown(self):
        self.server.close()
        self.folder.cleanup()

    def add(self, name, content, served=None, **more):
        """An entry that wants `content`; what is served is another thing where it is given."""
        self.server.files["/" + name] = content if served is None else served
        self.listed[name] = {"url": f"{self.server.url}/{name}", "licence": "MIT", "sha256": sha256(content), **more}

    def run_tool(self, *more):
        path = pathlib.Path(self.folder.name) / "list.ini"
        with open(path, "w", encoding="utf-8") as file:
            self.listed.write(file)
        environment = {k: v for k, v in os.environ.items() if not k.lower().endswith("_proxy")}
        environment["RESONID_RECORDINGS"] = str(self.to)
        return subprocess.run([TOOL, "--list", path, *more], env=environment, capture_output=True, text=True, timeout=60)

    def there(self):
        return sorted(str(p.relative_to(self.to)) for p in self.to.rglob("*") if p.is_file())

    def test_fetches_once_and_mends_what_is_damaged(self):
        self.add("a/x.csv", b"t,u\n0,1\n")
        first = self.run_tool()
        self.assertEqual((first.returncode, first.stderr), (0, ""))
        self.assertIn("fetched (MIT licence)", first.stdout)
        self.assertEqual((self.to / "a/x.csv").read_bytes(), b"t,u\n0,1\n")
        again = self.run_tool()
        self.assertIn("there already", again.stdout)
        self.assertEqual(len(self.server.asked), 1)
        (self.to / "a/x.csv").write_bytes(b"t,u\n")
        self.assertIn("replaced", self.run_tool().stdout)
        self.assertEqual((self.to / "a/x.csv").read_bytes(), b"t,u\n0,1\n")

    def test_a_wrong_checksum_leaves_nothing_and_what_was_there(self):
        self.add("a/x.csv", b"right", served=b"wrong")
        self.add("a/y.csv", b"good")
        result = self.run_tool()
        self.assertEqual(result.returncode, 1)
        self.assertIn(f"a/x.csv: sha256 {sha256(b'right')} is required, found {sha256(b'wrong')}", result.stderr)
        self.assertEqual(self.there(), ["a/y.csv"])

    def test_a_torn_answer_leaves_nothing(self):
        self.add("x.csv", b"0123456789" * 1000)
        self.server.torn.add("/x.csv")
        result = self.run_tool()
        self.assertEqual(result.returncode, 1)
        self.assertIn("x.csv", result.stderr)
        self.assertEqual(self.there(), [])

    def test_the_next_source_is_tried(self):
        self.add("x.csv", b"x")
        self.listed["x.csv"]["url"] = f"{self.server.url}/moved\n{self.server.url}/x.csv"
        self.assertEqual(self.run_tool().returncode, 0)
        self.assertEqual(self.server.asked, ["/moved", "/x.csv"])

    def test_without_a_network_it_says_what_to_do(self):
        with socket.socket() as closed:  # a port that nobody listens at
            closed.bind(("127.0.0.1", 0))
            for name in ("x.csv", "y.csv"):
                self.add(name, b"x")
                self.listed[name]["url"] = f"http://127.0.0.1:{closed.getsockname()[1]}/{name}"
            result = self.run_tool()
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"(?s)x\.csv: .*refused.*y\.csv: .*cannot be reached.*2 of 2 could not be had. Without a network: run "
                                        r"'tools/fetch_recordings --to FOLDER' on a machine that has one, and copy FOLDER to ")
        self.assertFalse(self.to.exists())

    def test_converts_a_mat_file(self):
        mat = io.BytesIO()
        scipy.io.savemat(mat, {"log": {"time": numpy.array([0.0, 0.5, 1.0]), "values": numpy.array([[1.0, 2.0], [0.01953125, 4.0], [5.0, 6.0]])},
                               "u": numpy.array([7.0, 8.0, 9.0])}, do_compression=True)
        table = b"t_s,k_s,a,u\n0,0.00,1,7\n0.5,0.25,0.0195312,8\n"
        columns = "t_s %g log.time\nk_s %.2f n/4\na %g log.values(:,1)\nu %g absent|u"
        self.add("x.csv", table, served=mat.getvalue(), convert="mat", rows="2", columns=columns)
        result = self.run_tool()
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertEqual((self.to / "x.csv").read_bytes(), table)
        self.listed["x.csv"].update({"columns": "a %g nowhere", "sha256": sha256(b"")})
        self.assertIn("has no variable nowhere; it has log, u", self.run_tool().stderr)
        self.server.files["/x.csv"] = b"<html>no such file</html>"
        self.assertIn("cannot be read as a MAT file", self.run_tool().stderr)
        self.assertEqual((self.to / "x.csv").read_bytes(), table)

    def test_the_list_is_complete_and_nothing_of_it_is_committed(self):
        listed = configparser.ConfigParser(interpolation=None)
        self.assertTrue(listed.read(LIST, encoding="utf-8"))
        folders = {name.split("/")[0] for name in listed.sections()}
        for name in listed.sections():
            self.assertEqual(listed[name]["licence"], "MIT")
            self.assertRegex(listed[name]["sha256"], "^[0-9a-f]{64}$")
            self.assertTrue(all(re.match(r"https://\S+/[0-9a-f]{8,40}/\S+$", url) for url in listed[name]["url"].split()))
        self.assertEqual(folders, {name.split("/")[0] for name in listed.sections() if name.endswith("/LICENSE")})
        self.assertIn("/recordings/", (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines())

    def test_its_conversions_give_the_recordings_to_the_byte(self):
        """Only where they are: a MAT file of the variables that the list names is made of each and converted back."""
        places = [os.environ.get("RESONID_RECORDINGS"), ROOT / "recordings", ROOT.parent / "shared" / "recordings"]
        present = next((pathlib.Path(place) for place in places if place and pathlib.Path(place).is_dir()), None)
        if present is None:
            self.skipTest("no recordings here")
        self.listed.read(LIST, encoding="utf-8")
        for name in self.listed.sections():
            entry, content = self.listed[name], (present / name).read_bytes()
            self.assertEqual(sha256(content), entry["sha256"], name)
            if "convert" in entry:
                content = self.mat_of(numpy.genfromtxt(io.BytesIO(content), delimiter=",", skip_header=1), entry["columns"])
            self.server.files["/" + name] = content
            entry["url"] = f"{self.server.url}/{name}"
        result = self.run_tool()
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    @staticmethod
    def mat_of(values, columns):
        content = {}
        for column, line in zip(values.T, columns.splitlines()):
            source = line.split()[2].split("|")[-1]
            if source.startswith("ScopeData.signals"):
                content.setdefault("ScopeData", {}).setdefault("signals", {})["values"] = values[:, 1:]
            elif source == "ScopeData.time":
                content.setdefault("ScopeData", {})["time"] = column
            elif not source.startswith("n/"):
                content[source] = numpy.append(column, 0.0)  # the original goes on
        mat = io.BytesIO()
        scipy.io.savemat(mat, content)
        return mat.getvalue()


if __name__ == "__main__":
    unittest.main()
