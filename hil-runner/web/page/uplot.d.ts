// uPlot stands before the modules in the page's script.
declare const uPlot: any;
