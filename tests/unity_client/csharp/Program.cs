// The test programs, chosen by the first argument. They print figures; pytest judges them.
using System;

public static class Program
{
    public static int Main(string[] arguments)
    {
        switch (arguments[0])
        {
            case "echo": Golden.Echo(Console.In); return 0;
            case "fuzz": return Golden.Fuzz(Console.In, int.Parse(arguments[1]), int.Parse(arguments[2]));
            default: Console.Error.WriteLine("no such program"); return 2;
        }
    }
}
