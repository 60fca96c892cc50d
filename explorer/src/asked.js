/**
 * What the page starts with, asked for before the page is built, so that Python and the browser work at the same time:
 * the names, the entries of the state, and their descriptions, each null or an error in its place.
 */
export function asked(server, state) {
  const describe = (entries) => Promise.all(entries.map(({ text, replaced }, k) => server.call("material", { text, replaced }, `start ${k}`).catch((error) => error)));
  const entries = state.materials;
  const described = entries.length ? describe(entries) : null;
  const names = server.call("names").catch((error) => error);
  if (described) return { names, entries, described };
  const given = names.then((answer) => (answer.given ?? []).map(({ text }) => ({ text, replaced: {} })));
  return { names, entries: given, described: given.then(describe) };
}
