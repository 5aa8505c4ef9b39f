#include "ContextCharacterComponent.h"

#include "Components/PoseableMeshComponent.h"
#include "GameFramework/Actor.h"
#include "Misc/FileHelper.h"
#include "Misc/Paths.h"

UContextCharacterComponent::UContextCharacterComponent()
{
    PrimaryComponentTick.bCanEverTick = true;
    PrimaryComponentTick.TickGroup = TG_PrePhysics;
}

void UContextCharacterComponent::BeginPlay()
{
    Super::BeginPlay();
    TArray<uint8> Bytes;
    const FString Path = FPaths::Combine(FPaths::ProjectContentDir(), Bundle);
    const char* Refusal = "the file cannot be read";
    if (FFileHelper::LoadFileToArray(Bytes, *Path))
    {
        Refusal = Crowd.Open(Bytes.GetData(), static_cast<std::size_t>(Bytes.Num()), TCHAR_TO_UTF8(*Controller), 1);
    }
    if (Refusal)
    {
        UE_LOG(LogTemp, Error, TEXT("%s: %s"), *Path, UTF8_TO_TCHAR(Refusal));
        return;
    }
    const FVector Place = GetOwner()->GetActorLocation();
    Crowd.Place(0, Place.X, Place.Y, GetOwner()->GetActorRotation().Yaw);
    for (std::size_t Joint = 0; Joint < Crowd.Num(CDBM_N_JOINTS); Joint++)
    {
        Bones.Add(FName(UTF8_TO_TCHAR(Crowd.JointName(Joint))));
    }
    Mesh = GetOwner()->FindComponentByClass<UPoseableMeshComponent>();
}

bool UContextCharacterComponent::SetText(const FString& Fact, const FString& Value)
{
    return Crowd.SetFact(0, TCHAR_TO_UTF8(*Fact), TCHAR_TO_UTF8(*Value));
}

bool UContextCharacterComponent::SetNumber(const FString& Fact, double Value)
{
    return Crowd.SetFact(0, TCHAR_TO_UTF8(*Fact), Value);
}

FString UContextCharacterComponent::GetWhy() const
{
    return Crowd.IsOpen() ? FString(UTF8_TO_TCHAR(Crowd.Asset(0))) + TEXT(" ") + UTF8_TO_TCHAR(Crowd.Why(0).c_str()) : FString();
}

void UContextCharacterComponent::TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction)
{
    Super::TickComponent(DeltaTime, TickType, ThisTickFunction);
    if (!Crowd.IsOpen())
    {
        return;
    }
    Crowd.Steer(0, Stick.X, Stick.Y);
    if (const char* Wrong = Crowd.Update(DeltaTime))
    {
        UE_LOG(LogTemp, Warning, TEXT("contextdb: %s"), UTF8_TO_TCHAR(Wrong));
        return;
    }
    const FVector Ground(0.0, 0.0, GetOwner()->GetActorLocation().Z);
    double X = 0.0, Y = 0.0, Yaw = 0.0;
    Crowd.Root(0, X, Y, Yaw);
    GetOwner()->SetActorLocationAndRotation(FVector(X, Y, Ground.Z), FRotator(0.0, Yaw, 0.0));
    if (!Mesh)
    {
        return;
    }
    Crowd.Joints(0, Joints);
    for (int32 Joint = 0; Joint < Bones.Num(); Joint++)
    {
        const contextdb::FJoint& At = Joints[static_cast<std::size_t>(Joint)];
        const auto Vector = [](const double* Of) { return FVector(Of[0], Of[1], Of[2]); };
        const FTransform Transform(Vector(At.X), Vector(At.Y), Vector(At.Z), Vector(At.Origin) + Ground);
        Mesh->SetBoneTransformByName(Bones[Joint], Transform, EBoneSpaces::WorldSpace);
    }
}
