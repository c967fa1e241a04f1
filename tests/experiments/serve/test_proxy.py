"""A server behind a proxy: its address, its host names, where its own links lead, and tokens with signs."""

from pathlib import Path
from urllib.parse import urlsplit

import pytest

from experiments.serve.refusals import refusal_page
from experiments.serve.server import _address  # pyright: ignore[reportPrivateUsage]
from experiments.serve.settings import Settings
from plant.errors import HydrostateError
from tests.experiments.serve.conftest import Served

URL = "https://plant.example/hydrostate/"
TOKEN = 'a+b&c;d#e%20 f="g'  # noqa: S105
BEARER = {"authorization": f"Bearer {TOKEN}"}


class _Listener:
    def getsockname(self) -> tuple[str, int]:
        return "127.0.0.1", 8765


def test_a_token_of_any_signs_opens_the_printed_address_and_stays_a_cookie(served: Served, tmp_path: Path) -> None:
    client = served(token=TOKEN)
    printed = urlsplit(_address(Settings(folder=tmp_path, token=TOKEN), _Listener()))  # pyright: ignore[reportArgumentType]
    entry = client.get(f"{printed.path}?{printed.query}")
    assert (printed.fragment, entry.status_code) == ("", 303)
    assert client.get("/api/logs").status_code == 200  # the client keeps the cookie
    assert client.get("/api/logs", headers=BEARER).status_code == 200


@pytest.mark.parametrize("token", ["0123456789abcdef\n", " 0123456789abcdef", "0123456789\tabcdef"])
def test_a_token_that_no_header_can_carry_is_refused(tmp_path: Path, token: str) -> None:
    with pytest.raises(HydrostateError, match="blank"):
        Settings(folder=tmp_path, token=token)


@pytest.mark.parametrize("host", ["plant.example", "127.0.0.1:8765"])
def test_a_page_behind_a_proxy_may_send_logs_whichever_host_the_proxy_passes_on(served: Served, host: str) -> None:
    client = served(token=TOKEN, url=URL)
    headers = {**BEARER, "host": host, "origin": "https://plant.example", "sec-fetch-site": "same-origin"}
    assert client.post("/api/logs", params={"name": "a.csv"}, content=b"a", headers=headers).status_code == 202
    for origin in ("https://evil.example", "null", ""):
        answer = client.post("/api/logs", params={"name": "a.csv"}, content=b"a", headers={**headers, "origin": origin})
        assert answer.status_code == 403


def test_without_an_address_no_origin_is_accepted_but_the_hosts_own(served: Served) -> None:
    client = served()
    for origin in ("https://plant.example", "null", ""):
        answer = client.post("/api/logs", params={"name": "a.csv"}, content=b"a", headers={"origin": origin})
        assert answer.status_code == 403


def test_the_printed_address_is_that_of_the_proxy_and_the_way_in_leads_into_its_folder(
    served: Served, tmp_path: Path
) -> None:
    said = _address(Settings(folder=tmp_path, token=16 * "a", url=URL), _Listener())  # pyright: ignore[reportArgumentType]
    assert said == f"{URL}?token={16 * 'a'}"
    entry = served(token=16 * "a", url=URL).get("/", params={"token": 16 * "a"})
    assert entry.headers["location"] == "./"
    assert "Secure" in entry.headers["set-cookie"]
    assert "Path" not in entry.headers["set-cookie"]


@pytest.mark.parametrize(("path", "home"), [("/fleet", "./"), ("/logs/0123456789abcdef", "../"), ("/a/b/c", "../../")])
def test_a_refusal_leads_to_all_logs_also_below_the_folder_of_a_proxy(path: str, home: str) -> None:
    assert f'<a href="{home}">All logs</a>' in refusal_page("not found", path)


@pytest.mark.parametrize("url", ["plant.example", "ftp://plant.example/", "https://", "https://[", "https://a/?b=c"])
def test_an_address_that_is_none_is_refused(tmp_path: Path, url: str) -> None:
    with pytest.raises(HydrostateError, match="--url must be"):
        Settings(folder=tmp_path, token=16 * "a", url=url)


def test_a_server_behind_a_proxy_needs_a_token(tmp_path: Path) -> None:
    with pytest.raises(HydrostateError, match="a token is needed"):
        Settings(folder=tmp_path, url=URL)
