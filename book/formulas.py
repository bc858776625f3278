"""Formulas of pages, `$...$` and `$$...$$`, as MathML, which browsers typeset without a script or a font of ours."""
from latex2mathml.converter import convert
from markdown.extensions import Extension
from markdown.inlinepatterns import InlineProcessor

FORMULA = r"(?<!\\)(?:\$\$(.+?)\$\$|\$([^\s$](?:[^$]*?[^\s$])?)\$)"


class Formula(InlineProcessor):
    def handleMatch(self, match, _text):
        display = "block" if match[1] else "inline"
        return self.md.htmlStash.store(convert(match[1] or match[2], display=display)), match.start(0), match.end(0)


class Formulas(Extension):
    def extendMarkdown(self, md):
        # Behind code in lines (190), before signs that are escaped (180).
        md.inlinePatterns.register(Formula(FORMULA, md), "formula", 186)


def makeExtension(**settings):
    return Formulas(**settings)
