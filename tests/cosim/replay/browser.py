"""A real browser: Chromium without a window, driven as a reader would drive it."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

CHROMIUM, CHROMEDRIVER = shutil.which("chromium"), shutil.which("chromedriver")
ARTEFACTS = Path(os.environ.get("SUBREACH_ARTEFACTS", Path(__file__).parents[3] / "build" / "screenshots"))

_QUIET = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
    "--window-size=1280,900", "--force-color-profile=srgb",
)  # fmt: skip
_PATIENCE = 120.0  # s
_TWO_PICTURES = "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => done(true)));"


class Browser:
    """One Chromium, one page at a time."""

    def __init__(self, profile):
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM
        for argument in (*_QUIET, f"--user-data-dir={profile}"):
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"performance": "ALL", "browser": "ALL"})
        self.driver = webdriver.Chrome(options, Service(CHROMEDRIVER))
        self.driver.set_page_load_timeout(_PATIENCE)
        self.driver.set_script_timeout(_PATIENCE)

    def open(self, file, size=(1280, 900), scheme="light"):
        """Open a page from disk, in a window of a size [CSS pixels], for a reader who likes light or dark."""
        self.driver.get("about:blank")
        self.logs()
        self.resize(*size)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        self.driver.get(Path(file).absolute().as_uri())
        self.wait_until("window.subreach?.ready === true")

    def resize(self, width, height):
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)

    def wait_until(self, condition):
        """Wait for a condition of the page, and let it paint."""
        from selenium.webdriver.support.ui import WebDriverWait

        WebDriverWait(self.driver, _PATIENCE).until(lambda _: self.js(f"return Boolean({condition})"))
        self.settle()

    def js(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def settle(self):
        """Let the page paint."""
        self.driver.execute_async_script(_TWO_PICTURES)

    def press(self, *keys):
        """Press keys, with whatever has the focus."""
        from selenium.webdriver.common.action_chains import ActionChains

        chain = ActionChains(self.driver)
        for key in keys:
            chain.send_keys(key)
        chain.perform()
        self.settle()

    def drag(self, element, start, *ways):
        """Drag what is at a place in an element by the mouse, along some ways."""
        from selenium.webdriver.common.action_chains import ActionChains

        at = [int(x - element.size[key] / 2) for x, key in zip(start, ("width", "height"), strict=True)]
        hand = ActionChains(self.driver).move_to_element_with_offset(element, *at).click_and_hold()
        for way in ways:
            hand.move_by_offset(*way)
        hand.release().perform()

    def scrub(self, time):
        """Drag the scrubber to a time, as far as the page can tell."""
        self.js(
            "const bar = document.querySelector('input[type=range]#scrubber');"
            "bar.value = subreach.page.timeline.axis.x(arguments[0]);"
            "bar.dispatchEvent(new Event('input', { bubbles: true }));",
            float(time),
        )
        self.settle()

    def land(self, time):
        """Scrub to a time, and then to its last bit: a range input keeps some fifteen digits."""
        self.scrub(time)
        assert abs(self.t - time) < 1e-9
        self.js("window.subreach.player.seek(arguments[0])", float(time))
        self.settle()

    @property
    def drawn(self):
        return self.js("return window.subreach.scene.drawn")

    @property
    def t(self):
        return self.js("return window.subreach.player.t")

    def logs(self):
        """Return all addresses that were asked since the last call, and all that the console complains of."""
        messages = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        asked = [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
        asked += [m["params"]["url"] for m in messages if m["method"] == "Network.webSocketCreated"]
        complaints = [e["message"] for e in self.driver.get_log("browser") if e["level"] in ("SEVERE", "WARNING")]
        return asked, complaints

    def shoot(self, name):
        """Keep a picture of the page for people to look at."""
        ARTEFACTS.mkdir(parents=True, exist_ok=True)
        file = ARTEFACTS / f"{name}.png"
        assert self.driver.save_screenshot(str(file))
        return file

    def close(self):
        self.driver.quit()
