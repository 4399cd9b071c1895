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
            case "round-trips": return Scenes.RoundTrips(arguments[1], int.Parse(arguments[2]));
            case "allocations": return Allocations.PerFrame(int.Parse(arguments[1]));
            case "large": return Large.Build(int.Parse(arguments[1]));
            case "refused": return Scenes.Refused(arguments[1]);
            case "scene-cases": return SceneCases.Feel(arguments[1], Console.In);
            case "restarts": return Scenes.Restarts(arguments[1], int.Parse(arguments[2]));
            case "surfaces": return Surfaces.Search(int.Parse(arguments[1]));
            default: Console.Error.WriteLine("unknown program"); return 2;
        }
    }
}
