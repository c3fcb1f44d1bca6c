// A worker draws on OffscreenCanvas alone; modules that it shares with the page also name the page's canvas.
interface HTMLCanvasElement extends OffscreenCanvas {}
interface CanvasRenderingContext2D extends OffscreenCanvasRenderingContext2D {}
