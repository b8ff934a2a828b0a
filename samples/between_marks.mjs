// Puts a table into a page of markdown, between '<!-- WRITER writes this table -->' and '<!-- end of the table -->'.
import {readFileSync, renameSync, writeFileSync} from 'node:fs';

/** Writes beside and renames. Ends the program with exit code 2 where the marks are missing. */
export function write_between_marks(page, writer, table) {
  const begin = `<!-- ${writer} writes this table -->`, end = '<!-- end of the table -->';
  const text = readFileSync(page, 'utf8');
  const from = text.indexOf(begin), to = text.indexOf(end, from);
  if (from < 0 || to < 0) {
    console.error(`${page}: the marks are missing. Put '${begin}' and '${end}' around the table.`);
    process.exit(2);
  }
  writeFileSync(`${page}.part`, `${text.slice(0, from + begin.length)}\n${table}\n${text.slice(to)}`);
  renameSync(`${page}.part`, page);
}
