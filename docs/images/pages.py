"""Flies scenarios, opens their replays in Chromium, and puts a picture of each where it is run."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.wait import WebDriverWait

from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

PICTURES = {  # the scenario, and the moment [s]
    "replay-docking.png": ("docking", 8.0),
    "replay-inspection.png": ("inspection-visibility", 40.0),
}
_SIZE = {"width": 1200, "height": 860, "deviceScaleFactor": 1, "mobile": False}
_PATIENCE = 30.0  # s


def main() -> None:
    """Draw them."""
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"):
        options.add_argument(flag)
    with tempfile.TemporaryDirectory() as scratch:
        for picture, (name, moment) in PICTURES.items():
            page = run_scenario(load_scenario(name), Path(scratch) / name).folder / "replay.html"
            with webdriver.Chrome(options, Service(shutil.which("chromedriver"))) as browser:
                browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", _SIZE)
                browser.get(page.as_uri())
                WebDriverWait(browser, _PATIENCE).until(lambda b: b.execute_script("return window.subreach?.ready"))
                browser.execute_script("subreach.player.seek(arguments[0]); subreach.paint()", moment)
                browser.save_screenshot(picture)
