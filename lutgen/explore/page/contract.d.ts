// What the server says; for the type checker alone.

export interface Overview {
  window: string;
  name: string;
  provenance: string;
  simulated: boolean;
  readings: number;
  hours: number[];
  max_hours: number;
  /** What is shown first: its table is on its way with the page. */
  first: { mode: string; hours: number; size: number };
  modes: string[];
  baseline: string;
  /** Names, and what the model knows of the display by each. */
  baselines: Record<string, string>;
  image: ImageSize | null;
  /** Null until the first comparison, which comes as an event. */
  error: ModelError | null;
  on: string[];
  /** The readings' file is a campaign file that the page has made of sessions. */
  written: boolean;
  /** Bytes of each kind of file that the server takes. */
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
  /** Number of the switching that it answers: the fit may come before the first step, on another connection. */
  switch: number;
  noise_ratio: number;
  mean_de2000: number;
  noise_de2000: number;
  /** The noise explains the error. */
  agrees: boolean;
  /** Where and which way the model errs most, or that it agrees, in the words of `lutgen compare`. */
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
  /** The error of those of its readings that another point has too, by the slice and the number of the other point. */
  within: Record<string, (number | null)[]>;
  /** Its number in the slice, in the order of `within`. */
  place: number;
}

export interface Reading {
  row: number;
  /** In the file. */
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
  /** Of what that is the size. */
  sees_of: string;
  visible: boolean;
  /** The model came with it. */
  given: boolean;
  alone_noise: number | null;
  /** It was tried alone, whether or not it could be fitted. */
  tried: boolean;
  on: boolean;
  own: boolean;
}

export interface Verdict {
  sentence: string;
  name: string;
  effects: string[];
  rivals: string[][];
  /** What else a reader must know. */
  remarks: string[];
  next: string;
}

/** What readings that were withheld from the fit say of it. */
export interface Support {
  /** `lutgen refine` asks for `--keep`. */
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
