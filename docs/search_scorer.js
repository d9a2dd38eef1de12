// Ranks the results of the search: how-to guides and theory first, diaries and lists last.
var Scorer = {
  score: ([docname, , , , score]) => {
    const ranks = { guides: 6, theory: 5, gallery: 3, reference: 2, names: 2 };
    const last = ["bibliography", "changelog", "contributing", "decisions", "thesis", "validation"];
    return score + (ranks[docname.split("/")[0]] || 0) - (last.includes(docname) ? 4 : 0);
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
