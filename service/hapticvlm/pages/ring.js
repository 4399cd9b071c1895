// A ring buffer of rows of numbers, in which the newest row replaces the oldest.

export class Ring {
  constructor(rows, columns) {
    this.rows = rows;
    this.columns = columns;
    this.count = 0;
    this.next = 0;
    this.values = new Float64Array(rows * columns);
  }

  // Adds a row with one value per column; null and undefined, a missing reading, become NaN.
  push(...row) {
    const start = this.next * this.columns;
    for (let column = 0; column < this.columns; column++) {
      this.values[start + column] = row[column] ?? NaN;
    }
    this.next = (this.next + 1) % this.rows;
    this.count = Math.min(this.count + 1, this.rows);
  }

  // Returns a value; row 0 is the oldest.
  at(row, column) {
    const place = (this.next - this.count + row + this.rows) % this.rows;
    return this.values[place * this.columns + column];
  }

  // Returns a sorted copy of one column, without missing values.
  sorted(column) {
    const values = new Float64Array(this.count);
    let size = 0;
    for (let row = 0; row < this.count; row++) {
      const value = this.at(row, column);
      if (!Number.isNaN(value)) values[size++] = value;
    }
    return values.subarray(0, size).sort();
  }
}

// Returns a quantile, linear between neighbours like numpy's default; null for no values.
export function quantile(sorted, share) {
  if (!sorted.length) return null;
  const place = (sorted.length - 1) * share;
  const below = Math.floor(place);
  const above = Math.min(below + 1, sorted.length - 1);
  return sorted[below] + (place - below) * (sorted[above] - sorted[below]);
}
