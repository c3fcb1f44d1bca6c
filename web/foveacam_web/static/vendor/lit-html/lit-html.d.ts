// The part of lit-html 3.3.3 that the console uses.

export interface TemplateResult {
  readonly _$litType$: 1 | 2;
  readonly strings: TemplateStringsArray;
  readonly values: unknown[];
}
export declare const html: (strings: TemplateStringsArray, ...values: unknown[]) => TemplateResult;
export declare const svg: (strings: TemplateStringsArray, ...values: unknown[]) => TemplateResult;
export declare const nothing: unique symbol;
export declare function render(value: unknown, container: HTMLElement | SVGElement | DocumentFragment): unknown;
