import { Albedo, Transmission } from "./albedo.js";
import { Lit } from "./lit.js";
import { Lobe } from "./lobe.js";
import { Mueller } from "./mueller.js";
import { Cartesian, Polar } from "./plots.js";
import { Slice } from "./slice.js";
import { Spectrum } from "./spectrum.js";
import { Facts, Fitting, Laws } from "./tables.js";

export const VIEWS = [Lobe, Lit, Polar, Cartesian, Slice, Albedo, Spectrum, Transmission, Mueller, Laws, Fitting, Facts];
