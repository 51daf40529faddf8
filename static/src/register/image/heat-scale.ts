/** The steps of the heat map: one sigma of a point on the water, px. The legend reads them too. */

export const HEAT_STEPS_PX = [1, 2, 4, 8, 16] as const;

/** The class of a cell: heat-0 is the surest, heat-5 beyond the last step. */
export function heatClass(sigmaPx: number): string {
  const step = HEAT_STEPS_PX.findIndex((limit) => sigmaPx <= limit);
  return `heat-${step === -1 ? HEAT_STEPS_PX.length : step}`;
}
