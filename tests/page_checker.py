"""What a page asks the network for, its tables, captions and words; its tags close."""

from html.parser import HTMLParser

VOID = {"meta", "br", "img"}


class Checker(HTMLParser):
    """Reads a page."""

    def __init__(self, text):
        super().__init__()
        self.open, self.asked, self.rows, self.captions, self.words = [], [], [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")
        elif tag == "figcaption":
            self.captions.append("")
        for name, value in attributes:
            if name in ("src", "href", "xlink:href") and value and not value.startswith(("#", "data:")):
                self.asked.append(value)

    def handle_startendtag(self, tag, attributes):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"style", "svg"} & {*self.open}:
            self.words.append(data)
        if {"td", "th"} & {*self.open}:
            self.rows[-1][-1] += data
        if "figcaption" in self.open:
            self.captions[-1] += data
