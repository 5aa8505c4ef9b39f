/* Ranks the sections of the site for a question: exact titles first, guides before reference. Pure, so that a test can run it. */
"use strict";

const COMMON = new Set(("a an and are as at be by can do does for from have how i if in is it its me my not of on or our out so that the their them " +
  "there this to us use was we what when where which who why will with you your").split(" "));
const ENDINGS = ["ations", "ation", "ingly", "ing", "ied", "ies", "ers", "er", "ed", "es", "ly", "s", "e"];

/** A word without its ending, so that "tables" is found by "table". */
function stem(word) {
  for (const ending of ENDINGS) {
    if (word.length - ending.length >= 4 && word.endsWith(ending)) return word.slice(0, -ending.length);
  }
  return word;
}

function wordsOf(text) {
  return (text.toLowerCase().match(/[\p{L}\p{N}_+#%]+(?:[.-][\p{L}\p{N}_+#%]+)*/gu) || []).flatMap((word) => word.includes("-") ? [word, ...word.split("-")] : [word]);
}

/** The words that a question is about; all of them where it has none but common ones. */
function wantedOf(question) {
  const words = wordsOf(question);
  const rare = words.filter((word) => !COMMON.has(word));
  return [...new Set((rare.length ? rare : words).map(stem))];
}

function prepared(sections) {
  const entries = sections.map(([page, anchor, title, pageTitle, isReference, counts]) => {
    const body = new Map();
    for (const [word, n] of Object.entries(counts)) for (const part of wordsOf(word)) body.set(stem(part), (body.get(stem(part)) || 0) + n);
    let size = 0;
    for (const n of body.values()) size += n;
    return { page, anchor, title, pageTitle, isReference, body, size, head: new Set(wordsOf(title).map(stem)), top: new Set(wordsOf(pageTitle + " " + page).map(stem)) };
  });
  const n = new Map();
  for (const entry of entries) for (const word of new Set([...entry.body.keys(), ...entry.head])) n.set(word, (n.get(word) || 0) + 1);
  return { entries, n };
}

/** The best sections, best first: [{page, anchor, title, pageTitle, score}]. */
function rank(index, question, most = 40) {
  const wanted = wantedOf(question);
  const plain = wordsOf(question).join(" ");
  const size = index.entries.reduce((sum, entry) => sum + entry.size, 0) / index.entries.length;
  const found = [];
  for (const entry of index.entries) {
    let score = 0, hits = 0;
    for (const word of wanted) {
      const rare = Math.log(1 + index.entries.length / (1 + (index.n.get(word) || 0)));
      const often = entry.body.get(word) || 0;
      const inBody = (2.2 * often) / (often + 1.2 * (0.4 + (0.6 * entry.size) / size));
      const value = inBody + (entry.head.has(word) ? 3.0 : 0) + (entry.top.has(word) ? 0.8 : 0);
      if (value > 0) hits += 1;
      score += rare * value;
    }
    if (!hits) continue;
    score *= (0.35 + (0.65 * hits) / wanted.length) * (entry.isReference ? 0.45 : 1);
    if (wordsOf(entry.title).join(" ") === plain) score += 1000;
    found.push({ page: entry.page, anchor: entry.anchor, title: entry.title, pageTitle: entry.pageTitle, score });
  }
  return found.sort((a, b) => b.score - a.score).slice(0, most);
}

if (typeof Search !== "undefined") {
  const index = prepared(SECTIONS);
  Search._performSearch = (question) =>
    rank(index, question)
      .reverse()
      .map((hit) => [
        hit.page,
        hit.title === hit.pageTitle ? hit.title : `${hit.pageTitle} > ${hit.title}`,
        hit.anchor ? "#" + hit.anchor : "",
        null,
        hit.score,
        hit.page + ".md",
        "title",
      ]);
} else if (typeof module !== "undefined") {
  module.exports = { prepared, rank };
}
