// View transforms, of call("session").

/** The view transform of a name; the first one where there is none. */
export const transformOf = (name, { views }) => views.find((view) => view.name === name) ?? views[0];
