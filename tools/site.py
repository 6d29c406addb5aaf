#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# tools/site.py -- README, docs/ and what else is written in Markdown as static pages that link to one another, without any script in them.
# Usage: site.py FOLDER. Needs cmark-gfm. A link to a file or a heading that is not there is an error. The order of pages is README's list of them.
import html
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent
MOVED = {"README.md": "index.html", "CONTRIBUTING.md": "contributing.html", "CHANGELOG.md": "changelog.html", "docs/decisions/README.md": "decisions/index.html"}


def place_of(source):
    """Where the page of a Markdown file goes, or a picture."""
    return MOVED.get(source) or re.sub(r"\.md$", ".html", source.removeprefix("docs/"))


def slug(heading):
    """The name of a heading in addresses, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", html.unescape(re.sub(r"<[^>]*>", "", heading)).lower()).replace(" ", "-")


class Page:
    def __init__(self, source):
        self.source, self.place = source, place_of(source)
        self.body = subprocess.run(["cmark-gfm", "-e", "table", TOP / source], check=True, capture_output=True, text=True).stdout
        self.title = re.sub(r"<[^>]*>", "", re.search(r"<h1>(.*?)</h1>", self.body, re.S)[1])
        self.headings, self.names = [], set()
        self.body = re.sub(r"<h([2-4])>(.*?)</h\1>", self.heading, self.body, flags=re.S)

    def heading(self, match):
        level, text = match[1], match[2]
        name, again = slug(text), 1
        while name in self.names:
            name, again = f"{slug(text)}-{again}", again + 1
        self.names.add(name)
        if level == "2":
            self.headings.append((name, text))
        return f'<h{level} id="{name}"><a href="#{name}">{text}</a></h{level}>' if "<a " not in text else f'<h{level} id="{name}">{text}</h{level}>'

    def to(self, place):
        return os.path.relpath(place, os.path.dirname(self.place) or ".")


def linked(page, pages, wrong):
    """The body with links to Markdown files and pictures turned into links to what they became."""
    pictures = set()

    def turn(match):
        attribute, target = match[1], html.unescape(match[2])
        if re.match(r"[a-z]+:", target):
            return match[0]
        path, _, name = target.partition("#")
        source = os.path.normpath(os.path.join(os.path.dirname(page.source), path)) if path else page.source
        if source in pages:
            if name and name not in pages[source].names:
                wrong.append(f"{page.source}: {target}: no such heading")
            return f'{attribute}="{html.escape(page.to(pages[source].place) if path else "")}{"#" + name if name else ""}"'
        if attribute == "src" and (TOP / source).is_file():
            pictures.add(source)
            return f'src="{html.escape(page.to(place_of(source)))}"'
        wrong.append(f"{page.source}: {target}: no such page or picture")
        return match[0]

    def name(match):  # a path of a document in a sentence leads there, too
        source = match[0]
        return f'<a href="{page.to(pages[source].place)}">{source}</a>' if source in pages and source != page.source else source

    body = re.sub(r'\b(href|src)="([^"]*)"', turn, page.body)
    parts = re.split(r"(<pre>.*?</pre>|<a .*?</a>|<[^>]*>)", body, flags=re.S)
    return "".join(part if part.startswith("<") else re.sub(r"\bdocs/[\w/-]+\.md\b", name, part) for part in parts), pictures


def contents(pages):
    """The groups of README's list of pages: (title, [(text, source)])."""
    part = re.search(r"^## Documentation\n(.*?)^## ", (TOP / "README.md").read_text(), re.S | re.M)[1]
    groups = []
    for item in re.findall(r"^- (.*?)(?=^- |\Z)", part, re.S | re.M):
        title = re.match(r"\*\*(.*?):?\*\*", item)[1].rstrip(":")
        links = [(" ".join(text.split()), path) for text, path in re.findall(r"\[(.*?)\]\((.*?)\)", item, re.S) if path in pages]
        groups.append((title, [(text[0].upper() + text[1:], path) for text, path in links]))
    groups[0][1].insert(0, ("Overview", "README.md"))
    return groups


def main(folder):
    sources = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"] + sorted(str(path.relative_to(TOP)) for path in (TOP / "docs").rglob("*.md"))
    pages = {source: Page(source) for source in sources}
    version = re.search(r'GBT_VERSION "(.*?)"', (TOP / "include/gbtrace/version.h").read_text())[1]
    groups, wrong = contents(pages), []
    order = [path for _, links in groups for _, path in links]
    wrong += [f"{source}: not in README's list of documents" for source in pages if source not in order and not source.startswith("docs/decisions/")]
    shutil.rmtree(folder, ignore_errors=True)
    for page in pages.values():
        body, pictures = linked(page, pages, wrong)
        body = body.replace("<table>", '<div class="wide"><table>').replace("</table>", "</table></div>")
        here = "docs/decisions/README.md" if page.source.startswith("docs/decisions/") else page.source
        menu = "".join(f"<h2>{title}</h2><ul>" + "".join(
            f'<li><a href="{page.to(pages[path].place)}"{current(path == here)}>{html.escape(text)}</a></li>' for text, path in links) + "</ul>"
            for title, links in groups)
        aside = "".join(f'<li><a href="#{name}">{re.sub("</?a[^>]*>", "", text)}</a></li>' for name, text in page.headings)
        at = order.index(page.source) if page.source in order else None
        around = [] if at is None else [("prev", "Before: ", at - 1), ("next", "Next: ", at + 1)]
        turn = "".join(f'<a rel="{rel}" href="{page.to(pages[order[k]].place)}"><span>{word}</span>{html.escape(pages[order[k]].title)}</a>'
                       for rel, word, k in around if 0 <= k < len(order))
        out = folder / page.place
        out.parent.mkdir(parents=True, exist_ok=True)
        title = page.title if page.title == "gbtrace" else f"{page.title} - gbtrace"
        out.write_text(f'''<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{html.escape(html.unescape(title))}</title>
<link rel="icon" href="{page.to("icon.svg")}">
<link rel="stylesheet" href="{page.to("site.css")}">
</head>
<body>
<a class="skip" href="#text">To the text</a>
<header><a class="name" href="{page.to("index.html")}"><img src="{page.to("icon.svg")}" alt="" width="24" height="24">gbtrace</a> <a class="version" href="{page.to("changelog.html")}">{version}</a>
<input type="checkbox" id="menu" aria-label="Show all pages"><label for="menu">Pages</label></header>
<nav class="pages" aria-label="Pages">{menu}</nav>
<main id="text">
{body}
<nav class="turn" aria-label="Before and next">{turn}</nav>
</main>
{f'<nav class="here" aria-label="On this page"><h2>On this page</h2><ul>{aside}</ul></nav>' if len(page.headings) > 1 else ""}
</body>
</html>
''')
        for picture in pictures:
            (folder / place_of(picture)).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(TOP / picture, folder / place_of(picture))
    shutil.copyfile(TOP / "tools/site.css", folder / "site.css")
    shutil.copyfile(TOP / "src/view/page/icon.svg", folder / "icon.svg")
    for line in wrong:
        print(f"error: {line}", file=sys.stderr)
    if not wrong:
        print(f"{folder}/index.html: {len(pages)} pages")
    return 1 if wrong else 0


def current(yes):
    return ' aria-current="page"' if yes else ""


if len(sys.argv) != 2:
    sys.exit("usage: site.py FOLDER")
sys.exit(main(Path(sys.argv[1])))
