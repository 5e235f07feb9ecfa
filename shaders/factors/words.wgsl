// Words of the tables that passes of factors by error hand on to each other.

// A block: log2 of the metres of code 254 in bins, two spare, 17 rows of 17 codes in five words, then the west and
// the east column.
const GRADE_WORDS = 98u;
// A patch slot in the first part of `leaves`: record, 17 rows of own nodes, extras of 4 sides.
const NODE_WORDS = 32u;
// And in its second part: four masks of leaves a row, what lies before each row, own nodes of the sides.
const LEAF_WORDS = 96u;
