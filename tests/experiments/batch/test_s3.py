"""A store on a local server that speaks S3.

Neither s3fs nor moto[server] is in the extra `dev`: they bring 70 packages and half a minute of installing. s3fs needs
an older fsspec and botocore needs an older python-dateutil than the pinned ones. To run this test, install both without
the constraints.
"""

import pyarrow as pa
import pytest

from experiments.batch.part_store import open_store
from experiments.batch.report import write_report
from tests.experiments.batch.conftest import run_into, small_plan

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]


def test_a_store_on_s3_is_resumed_and_has_the_same_rows(reference: pa.Table, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("s3fs", reason="the extra `remote` is not installed")
    server = pytest.importorskip("moto.server", reason="moto[server] is not installed").ThreadedMotoServer(port=0)
    server.start()
    try:
        host, port = server.get_host_and_port()
        for name, value in (
            ("ENDPOINT_URL", f"http://{host}:{port}"),
            ("ACCESS_KEY_ID", "test"),
            ("REGION", "us-east-1"),
        ):
            monkeypatch.setenv(f"AWS_{name}", value)
        monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "test")
        import s3fs

        s3fs.S3FileSystem().mkdir("hydrostate")
        store = open_store("s3://hydrostate/studies/small")
        run_into(store, small_plan(seeds=2))
        assert run_into(store, small_plan()).done == 12
        assert store.rows().equals(reference)
        assert not [name for name in store.folder.files("parts") if name.endswith(".tmp")]
        assert write_report(store, store.folder) == "s3://hydrostate/studies/small/report.html"
    finally:
        server.stop()
