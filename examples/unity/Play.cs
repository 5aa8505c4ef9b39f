// Asks a table for every moment of a file, a line of NAME=VALUE each with tabs between, and prints what it answers: mono Play.exe TABLE MOMENTS
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using ContextDB;

static class Play
{
    static void Set(ContextTable table, int fact, FactType type, string value)
    {
        if (type == FactType.Tags) table.Set(fact, (IList<string>)value.Split(new[] { ' ' }, StringSplitOptions.RemoveEmptyEntries));
        else if (type == FactType.Enum || type == FactType.Text || type == FactType.Date) table.Set(fact, value);
        else table.Set(fact, double.Parse(value, CultureInfo.InvariantCulture));
    }

    static int Main(string[] arguments)
    {
        try
        {
            using (var table = ContextTable.Open(arguments[0], 7))
            {
                double time = 0.0;
                foreach (string line in File.ReadAllLines(arguments[1]))
                {
                    foreach (string part in line.Split('\t'))
                    {
                        int at = part.IndexOf('=');
                        string name = part.Substring(0, at);
                        Set(table, table[name], table.Facts[name], part.Substring(at + 1));
                    }
                    table.Query();
                    int row = table.Pick(time);
                    Console.WriteLine(string.Join(" ", table.Rows) + "|" + row + "|" + table.Asset(row) + "|" + table.Digest);
                    time += 0.5;
                }
            }
            return 0;
        }
        catch (ContextException refusal)
        {
            Console.Error.WriteLine(refusal.Message);
            return 1;
        }
    }
}
