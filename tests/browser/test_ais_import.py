"""A recording goes in as people do it: sent, looked at, its columns set, imported, counted."""

import re

from playwright.sync_api import FilePayload, Page, expect

from tests.browser.axe import findings

# No name says what a column is, and the speeds are in metres a second.
TABLE = """wer;wann;hoch;quer;v;kurs;schiff
211000711;31.05.2024 12:00:06;53,5400;9,9800;5,0;90,5;<b>ELBE 3</b>
211000711;31.05.2024 12:00:16;53,5401;9,9810;5,0;90,5;<b>ELBE 3</b>
211000712;31.05.2024 12:00:17;91,0000;181,0000;0,0;;
992110001;31.05.2024 12:00:18;53,5500;9,9900;0,0;;BOJE
211000713;31.05.2024 12:00:19;53,5410;9,9700;schnell;12;
"""


def test_a_table_is_sent_looked_at_mapped_and_imported(page: Page) -> None:
    """Each page says what to look at; the sums at the end count every row, also the bad ones."""
    file: FilePayload = {
        "name": "elbe.csv",
        "mimeType": "text/csv",
        "buffer": TABLE.encode(),
    }
    page.goto("/ais")
    page.get_by_label("File").set_input_files(file)
    page.get_by_role("button", name="Send and look").click()
    expect(page).to_have_url(re.compile("/ais/uploads/[0-9]+$"))
    expect(page.get_by_text("Column 3 (hoch) is taken as lat by its values.")).to_be_visible()
    rejected = page.get_by_role("region", name="What would be rejected")
    expect(rejected.get_by_role("row")).to_have_count(3)
    page.get_by_label("What column 5 holds").select_option("Speed")
    page.get_by_label("Speeds").select_option("Metres a second")
    page.get_by_role("button", name="Read it this way").click()
    expect(rejected.get_by_text("'schnell' is no number")).to_be_visible()
    reports = page.get_by_role("region", name="First reports")
    expect(reports.get_by_text("9.7").first).to_be_visible()
    expect(reports.get_by_text("<b>ELBE 3</b>").first).to_be_visible()
    assert findings(page) == []
    page.get_by_role("button", name="Import").click()
    page.get_by_role("link", name="What became of every line").click()
    expect(page).to_have_url(re.compile("/ais/files/[0-9]+$"))
    messages = page.get_by_role("region", name="Messages")
    for row in ("Positions 2", "unreadable cell 1", "not a vessel 1", "= all messages 5"):
        expect(messages).to_contain_text(re.compile(row.replace(" ", r"\s*"), re.IGNORECASE))
    assert findings(page) == []
    with page.expect_download() as download:
        page.get_by_role("link", name="Download as CSV").click()
    assert "'schnell' is no number" in download.value.path().read_text()
