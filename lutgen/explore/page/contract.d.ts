// Types of the server's messages, only for the type checker.

export interface Overview {
  window: string;
  name: string;
  provenance: string;
  simulated: boolean;
  readings: number;
  hours: number[];
  max_hours: number;
  /** The first mode and hours: their table is sent with the page. */
  first: { mode: string; hours: number; size: number };
  modes: string[];
  baseline: string;
  /** Names of baselines, and what the model knows of the display with each. */
  baselines: Record<string, string>;
  image: ImageSize | null;
  /** Null until the first comparison, which is sent as an event. */
  error: ModelError | null;
  on: string[];
  /** The file of the readings is a campaign file that was written for the page from dropped sessions. */
  written: boolean;
  /** Most bytes of each kind of file that the server accepts. */
  limits: { readings: number; image: number; code: number };
  can_diagnose: boolean;
}

export interface NeededHours {
  needs_hours: { name: string; dated: string | null }[];
}

export interface ImageSize {
  width: number;
  height: number;
  shown_width: number;
  shown_height: number;
  note: string;
}

export interface ModelError {
  provisional?: boolean;
  what_if?: boolean;
  /** Number of the switch request: the fit may arrive before the first step, on another connection. */
  switch: number;
  noise_ratio: number;
  mean_de2000: number;
  noise_de2000: number;
  /** The noise explains the error. */
  agrees: boolean;
  /** The sentence of `lutgen compare`: place and direction of the largest error, or that the model agrees. */
  sentence: string;
  effects: FittedEffect[];
  slices: Slice[];
  readings: Reading[];
  drift: Drift[];
}

export interface FittedEffect {
  name: string;
  /** The model came with it. */
  given: boolean;
  parameters: Parameter[];
  supported: boolean;
  said: string;
}

export interface Parameter {
  name: string;
  words: string;
  value: number;
  /** The fit's value with its standard error and unit, as `lutgen refine` prints it. */
  fit: string;
  /** Ends of the 95 % interval. */
  low: number | null;
  high: number | null;
  bounds: [number, number];
  unit: string;
}

export interface Slice {
  name: string;
  label: string;
  unit: string;
  points: Point[];
}

export interface Point {
  at: number | string;
  label: string;
  ratio: number;
  rows: number[];
  /** The error of the readings that this point shares with another point, by slice and number of the other point. */
  within: Record<string, (number | null)[]>;
  /** Number of the point in its slice: the index in `within`. */
  place: number;
}

export interface Reading {
  row: number;
  /** Line in the file. */
  line: number;
  patch: [number, number, number];
  hours: number;
  measured: [number, number, number];
  predicted: [number, number, number];
  de2000: number;
  sigma: number;
}

export interface Drift {
  name: string;
  /** Hours, u′ and v′ measured, u′ and v′ predicted. */
  points: [number, number, number, number, number][];
}

export interface Effect {
  name: string;
  sentence: string;
  sees_words: string;
  /** The parameter of this size. */
  sees_of: string;
  visible: boolean;
  /** The model came with it. */
  given: boolean;
  alone_noise: number | null;
  /** Whether the effect was tried alone, also if its fit failed. */
  tried: boolean;
  on: boolean;
  own: boolean;
}

export interface Verdict {
  sentence: string;
  name: string;
  effects: string[];
  rivals: string[][];
  /** Further remarks for the user. */
  remarks: string[];
  next: string;
}

/** The result of the test of the fit on withheld readings. */
export interface Support {
  /** Whether `lutgen refine` requires `--keep`. */
  keep: boolean;
  sentence: string;
}

export interface Figures {
  mean: number | null;
  mean_2sd: number | null;
  hours_to_3: number | null;
  hours_to_5: number | null;
}

export interface Command {
  words: string;
  command: string;
}
