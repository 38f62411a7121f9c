"""Chromium without a window, driven by selenium (extra `foreign`; Debian: chromium, chromium-driver)."""

import shutil
import time
from contextlib import contextmanager
from importlib import import_module


@contextmanager
def chromium(width=1400, height=1000):
    """Give a browser that tells of its console and its network."""
    webdriver = import_module("selenium.webdriver")
    service = import_module("selenium.webdriver.chrome.service").Service
    programs = [shutil.which(name) for name in ("chromium", "chromedriver")]
    assert all(programs), "chromium or chromedriver is missing: apt-get install chromium chromium-driver"
    options = webdriver.ChromeOptions()
    options.binary_location = programs[0]
    for word in ("--headless=new", "--no-sandbox", "--disable-gpu", f"--window-size={width},{height}"):
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=service(programs[1]))
    try:
        yield driver
    finally:
        driver.quit()


def wait(driver, condition, seconds=30.0):
    """Wait until a script's value is true, and return it."""
    end = time.monotonic() + seconds
    while not (value := driver.execute_script(f"return {condition}")):
        assert time.monotonic() < end, f"{condition} did not become true; console: {driver.get_log('browser')}"
        time.sleep(0.02)
    return value
