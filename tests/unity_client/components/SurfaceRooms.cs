// A room of one mesh with 20 materials: prints the surface and the material that is felt on each of its panels.
using System;
using System.Collections.Generic;
using HapticVLM;
using HapticVLM.Wire;
using UnityEngine;
using Object = UnityEngine.Object;

public static class SurfaceRooms
{
    static readonly string[] Names =
    {
        "Oak_Planks", "Brushed_Steel", "mat14", "Window_Glass", "Marble_White", "Red_Brick", "Black_Rubber", "Leather_Brown", "Cardboard_Box", "Plastic_ABS",
        "Wool_Carpet", "Copper", "Paper_Sheet", "Ceramic_Tile", "Granite", "Pine", "Linen", "Porcelain", "Suede", "Walnut",
    };

    static void Kept(string url)
    {
        Rooms(url, room => room.AddComponent<BoxCollider>(), true);
    }

    static void ByRays(string url)
    {
        Rooms(url, Exact, false);
    }

    static void Unreadable(string url)
    {
        Rooms(url, room => room.AddComponent<BoxCollider>(), false);
    }

    static Collider Exact(GameObject room)
    {
        var collider = room.AddComponent<MeshCollider>();
        collider.sharedMesh = room.GetComponent<MeshFilter>().sharedMesh;
        return collider;
    }

    // Panels side by side along x, each 2 cm wider than the one before.
    static GameObject Panels(string name, bool isReadable)
    {
        Material[] materials = Array.ConvertAll(Names, each => new Material { name = each });
        materials[2].Set("_BaseMap", new Texture { name = "T_Felt_D" });
        return Panels(name, materials, i => 0.4f + 0.02f * i, isReadable);
    }

    // One mesh with a panel of this width at each metre along x, and a material for each.
    public static GameObject Panels(string name, Material[] materials, Func<int, float> widthM, bool isReadable = true)
    {
        int count = materials.Length;
        var mesh = new Mesh { name = "Panels", subMeshCount = count, isReadable = isReadable, Points = new Vector3[4 * count], Triangles = new int[count][] };
        for (int i = 0; i < count; i++)
        {
            for (int corner = 0; corner < 4; corner++)
                mesh.Points[4 * i + corner] = new Vector3(corner == 1 || corner == 2 ? i + widthM(i) : i, corner >= 2 ? 1f : 0f, 0f);
            mesh.Triangles[i] = new[] { 4 * i, 4 * i + 1, 4 * i + 2, 4 * i, 4 * i + 2, 4 * i + 3 };
        }
        var room = new GameObject(name);
        room.SetActive(false);
        room.AddComponent<MeshFilter>().sharedMesh = mesh;
        room.AddComponent<MeshRenderer>().sharedMaterials = materials;
        return room;
    }

    static Vector3 On(int panel)
    {
        return new Vector3(panel + 0.2f, 0.5f, 0.01f);
    }

    static void Rooms(string url, Func<GameObject, Collider> collider, bool isReadable)
    {
        HapticClient client = Components.Client(url);
        var felt = new Dictionary<long, string>();
        GameObject room = Panels("mesh2057757694", isReadable);
        Collider met = collider(room);
        var one = room.AddComponent<HapticObject>();
        client.Decided += decision => { if (decision.ObjectId == one.ObjectId) felt[decision.Surface ?? 0] = decision.Material; };
        HapticHand hand = Moves.Hand(new Vector3(0f, 0f, 9f));
        Components.Run(() => client.State == LinkState.Ready && client.IsOwner, "no welcome");
        room.SetActive(true);
        Components.RunFor(30); // a thread prepares the search
        for (int i = 0; i < Names.Length; i++)
        {
            hand.transform.position = On(i);
            Player.Tick();
            felt.Clear();
            Player.Send(hand.gameObject, "OnTriggerEnter", met);
            int seen = i;
            Components.Run(() => felt.Count > 0 || !isReadable && !(met is MeshCollider) && seen > 0, "nothing is decided on " + Names[i]);
            Components.RunFor(10);
            foreach (KeyValuePair<long, string> each in felt) Components.Say("felt " + Names[i] + " surface " + each.Key + " material " + each.Value);
            Player.Send(hand.gameObject, "OnTriggerExit", met);
            Components.RunFor(5);
        }
        Components.Say("warnings " + Components.Warnings() + " errors " + Debug.Errors + " exceptions " + Debug.Exceptions);
        Object.Destroy(client.gameObject);
    }

    // A hand slides over all panels in one touch.
    static void SlidOver(string url)
    {
        HapticClient client = Components.Client(url);
        GameObject room = Panels("mesh2057757694", true);
        Collider met = room.AddComponent<BoxCollider>();
        var one = room.AddComponent<HapticObject>();
        var felt = new List<string>();
        client.Decided += decision => { if (decision.ObjectId == one.ObjectId) felt.Add(decision.Material + " " + decision.Surface); };
        HapticHand hand = Moves.Hand(new Vector3(0f, 0f, 9f));
        Components.Run(() => client.State == LinkState.Ready && client.IsOwner, "no welcome");
        room.SetActive(true);
        Components.RunFor(30);
        hand.transform.position = On(0);
        Player.Tick();
        Player.Send(hand.gameObject, "OnTriggerEnter", met);
        for (int i = 0; i < 5; i++)
        {
            hand.transform.position = On(i);
            int before = felt.Count;
            Components.Run(() => felt.Count > before, "nothing is decided on " + Names[i]);
        }
        Components.Say("slid over " + string.Join(", ", felt.ToArray()));
        Object.Destroy(client.gameObject);
    }

    // The materials of a lower level of detail, of a disabled renderer and of another object are no surfaces of an object.
    static void Levels()
    {
        GameObject room = Panels("Room", true);
        var shown = room.GetComponent<MeshRenderer>();
        MeshRenderer lower = Drawn(room, "LowerLevel", "Gold"), hidden = Drawn(room, "Highlight", "Gold"), other = Drawn(room, "Vase", "Gold");
        hidden.enabled = false;
        other.gameObject.AddComponent<HapticObject>();
        room.AddComponent<LODGroup>().Levels = new[] { new LOD { renderers = new Renderer[] { shown } }, new LOD { renderers = new Renderer[] { lower } } };
        var one = room.AddComponent<HapticObject>();
        room.SetActive(true);
        var stated = (SceneObject)typeof(HapticObject).GetMethod("Describe", System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic).Invoke(one, null);
        var names = new List<string>();
        foreach (ObjectSurface surface in stated.Surfaces) names.Add(surface.Name);
        Components.Say("surfaces " + names.Count + " first " + names[0] + " gold " + names.Contains("Gold") + " felt " + names.Contains("T_Felt_D/mat14"));
    }

    static MeshRenderer Drawn(GameObject parent, string name, string material)
    {
        var child = new GameObject(name);
        child.transform.SetParent(parent.transform, false);
        child.AddComponent<MeshFilter>().sharedMesh = new Mesh();
        var renderer = child.AddComponent<MeshRenderer>();
        renderer.sharedMaterial = new Material { name = material };
        return renderer;
    }
}
