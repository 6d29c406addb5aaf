# SPDX-License-Identifier: Apache-2.0
# tests/project/check_links.py -- links of a folder of pages that lead nowhere: files, and headings in them. Usage: check_links.py FOLDER
import os
import sys
from html.parser import HTMLParser
from pathlib import Path


class Page(HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.names, self.links, self.open = set(), [], []
        self.feed(path.read_text())
        self.close()

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.names.add(values.get("id"))
        self.links += [values[name] for name in ("href", "src") if name in values]
        if tag not in ("meta", "link", "img", "input", "br", "hr"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)

    def handle_endtag(self, tag):
        if self.open[-1:] == [tag]:
            self.open.pop()
        else:
            self.links.append(f"</{tag}> closes {self.open[-1:]}")


folder = Path(sys.argv[1]).resolve()
pages = {path: Page(path) for path in folder.rglob("*.html")}
wrong, reached = [], {folder / "index.html"}
for path, page in pages.items():
    for link in page.links:
        file, _, name = link.partition("#")
        if link.startswith(("https://", "http://")):
            continue
        to = Path(os.path.normpath(path.parent / file)) if file else path
        reached.add(to)
        if not to.is_file() or (name and name not in pages[to].names):
            wrong.append(f"{path.relative_to(folder)}: {link}")
wrong += [f"{path.relative_to(folder)}: no page leads there" for path in sorted(folder.rglob("*")) if path.is_file() and path not in reached]
print("\n".join(wrong) or f"{len(pages)} pages, {sum(len(page.links) for page in pages.values())} links")
sys.exit(bool(wrong))
